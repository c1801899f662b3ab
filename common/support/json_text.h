// Serialization of JSON with any bytes in its strings, because file names need not be UTF-8. For code that includes
// nlohmann's JSON library.
#pragma once

#include <string>

namespace pictura {

/// Serializes JSON. Invalid UTF-8 becomes U+FFFD, because an exception could lose the results of long work. indent:
/// spaces per level; -1: one line.
template <typename Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace pictura
