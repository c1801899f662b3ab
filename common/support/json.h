// Reading and writing of JSON, which has neither infinity nor NaN.
#pragma once

#include <cmath>
#include <string_view>

#include <nlohmann/json.hpp>

namespace pictura {

/// JSON whose keys keep the order of insertion.
using Json = nlohmann::ordered_json;

inline Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// Maximum nesting depth. The JSON library recurses, so deeper values could overflow the stack.
constexpr int kMaxJsonDepth = 64;

/// Offset of the first byte that is nested deeper than kMaxJsonDepth, or npos.
inline size_t first_too_deep(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kMaxJsonDepth) return i;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return std::string_view::npos;
}

/// Parses JSON. Throws the JSON library's parse_error if the text is not JSON or too deep. Without exceptions, returns
/// a value whose is_discarded() is true.
template <typename Value = Json>
Value parse_json(std::string_view text, bool allow_exceptions = true) {
  const size_t too_deep = first_too_deep(text);
  if (too_deep == std::string_view::npos) return Value::parse(text, nullptr, allow_exceptions);
  if (!allow_exceptions) return Value(nlohmann::detail::value_t::discarded);
  throw Value::parse_error::create(
      101, too_deep, "expected values nested at most " + std::to_string(kMaxJsonDepth) + " deep", nullptr);
}

}  // namespace pictura
