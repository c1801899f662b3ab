// JSON as text for any bytes in its strings: file names need not be UTF-8. For code that includes nlohmann's JSON.
#pragma once

#include <string>

namespace pictura {

/// Serializes JSON, replacing invalid UTF-8 by U+FFFD instead of throwing at the end of long work. indent: spaces per
/// level; -1: one line.
template <typename Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace pictura
