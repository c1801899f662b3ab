// Limit of the nesting depth of external JSON.
#include "pictura/common/support/json.h"

#include <gtest/gtest.h>

namespace pictura {
namespace {

std::string nested(int depth, const std::string& inside = "") {
  return std::string(static_cast<size_t>(depth), '[') + inside + std::string(static_cast<size_t>(depth), ']');
}

TEST(Json, DepthIsLimited) {
  EXPECT_EQ(parse_json(nested(kMaxJsonDepth, "1")).dump(), nested(kMaxJsonDepth, "1"));
  EXPECT_EQ(first_too_deep(nested(kMaxJsonDepth + 1)), static_cast<size_t>(kMaxJsonDepth));
  EXPECT_THROW(parse_json(nested(kMaxJsonDepth + 1)), Json::parse_error);
  EXPECT_THROW(parse_json("{\"a\": " + nested(1'000'000)), Json::parse_error);
  EXPECT_TRUE(parse_json(nested(1'000'000), /*allow_exceptions=*/false).is_discarded());
  // Adjacent values add no depth, and brackets within a text are characters.
  EXPECT_EQ(parse_json("[" + nested(60) + "," + nested(60) + "]").size(), 2u);
  const std::string brackets(200, '[');
  EXPECT_EQ(first_too_deep("[\"" + brackets + "\"]"), std::string_view::npos);
  EXPECT_EQ(first_too_deep("[\"" + brackets + "\\\"" + brackets + "\\\\\"]"), std::string_view::npos);
}

TEST(Json, InvalidTextIsAParseError) {
  for (const char* text : {"", "[", "]", "{]", "[1,]", "nul", "\"\\"}) {
    EXPECT_THROW(parse_json(text), Json::parse_error) << text;
    EXPECT_TRUE(parse_json(text, /*allow_exceptions=*/false).is_discarded()) << text;
  }
}

}  // namespace
}  // namespace pictura
