// Fields of CSV files.
#pragma once

#include <string>

namespace pictura {

/// Quotes a text (RFC 4180).
inline std::string csv_quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result.append(c == '"' ? 2 : 1, c);
  return result + '"';
}

}  // namespace pictura
