// Parsing of numbers that users write.
#include "pictura/common/support/numbers.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace pictura {
namespace {

TEST(Numbers, WrittenNumbersAreReadWhole) {
  EXPECT_EQ(parse_written_number("1.5"), 1.5);
  EXPECT_EQ(parse_written_number("-2.5e-310"), -2.5e-310);
  EXPECT_EQ(parse_written_number("inf"), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(parse_written_number("nan").value()));
  for (const char* text : {"", "1,5", "1.5 ", " 1.5", "1.5x", "0x1p3"}) {
    EXPECT_EQ(parse_written_number(text), std::nullopt) << text;
  }
}

TEST(Numbers, WholeNumbersAreDecimalInAnyNotationAndExact) {
  EXPECT_EQ(parse_unsigned("10"), 10u);
  EXPECT_EQ(parse_unsigned("010"), 10u) << "no octal";
  EXPECT_EQ(parse_unsigned("1e3"), 1000u);
  EXPECT_EQ(parse_unsigned("1.5E+3"), 1500u);
  EXPECT_EQ(parse_unsigned("1000.0"), 1000u);
  EXPECT_EQ(parse_unsigned("120e-1"), 12u);
  EXPECT_EQ(parse_unsigned("0e999999"), 0u);
  EXPECT_EQ(parse_unsigned("-0"), 0u);
  EXPECT_EQ(parse_unsigned("18446744073709551615"), std::numeric_limits<uint64_t>::max());
  EXPECT_EQ(parse_unsigned("18446744073709551616"), std::nullopt) << "no saturation";
  EXPECT_EQ(parse_unsigned("-1"), std::nullopt) << "no wrap";
  EXPECT_EQ(parse_unsigned("9007199254740993e0"), 9007199254740993u) << "more than a double holds";
  EXPECT_EQ(parse_integer("-9223372036854775808"), std::numeric_limits<int64_t>::min());
  EXPECT_EQ(parse_integer("9223372036854775808"), std::nullopt);
  EXPECT_EQ(parse_integer("-1e2"), -100);
  for (const char* text : {"", "-", ".", "e3", "1e", "0x10", "1_000", "1,5", "12abc", " 1", "1 ", "nan", "1.5", "15e-1",
                           "1e20", "1e9999999"}) {
    EXPECT_EQ(parse_unsigned(text), std::nullopt) << text;
    EXPECT_EQ(parse_integer(text), std::nullopt) << text;
  }
}

TEST(Numbers, FractionsAreDecimalAndFinite) {
  EXPECT_EQ(parse_number("0.25"), 0.25);
  EXPECT_EQ(parse_number("+.5"), 0.5);
  EXPECT_EQ(parse_number("-2."), -2.0);
  EXPECT_EQ(parse_number("010.5"), 10.5);
  EXPECT_EQ(parse_number("1e-3"), 1e-3);
  for (const char* text : {"", "nan", "inf", "-inf", "0x1p3", "1e999", "1.2.3", "1 m", "+-1", "--1"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << text;
  }
}

TEST(Numbers, IntendedNumbersAreRecognizedByTheirStart) {
  for (const char* text : {"0x10", "1_000", "-.5x", "+3"}) EXPECT_TRUE(looks_like_number(text)) << text;
  for (const char* text : {"cpu", "", "-", "nan", "--1"}) EXPECT_FALSE(looks_like_number(text)) << text;
}

TEST(Numbers, MessagesHaveAtMost15Digits) {
  EXPECT_EQ(text_of_number(0.1), "0.1");
  EXPECT_EQ(text_of_number(2147483647), "2147483647");
  EXPECT_EQ(text_of_number(std::numeric_limits<double>::max()), "1.79769313486232e+308");
}

}  // namespace
}  // namespace pictura
