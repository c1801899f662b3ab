// JSON as text, whatever bytes its texts hold: names of files need not be UTF-8. For whoever includes nlohmann's JSON.
#pragma once

#include <string>

namespace pictura {

/// With U+FFFD in the place of bytes that are no UTF-8, rather than an exception at the end of long work. indent:
/// spaces a level; -1: one line.
template <typename Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace pictura
