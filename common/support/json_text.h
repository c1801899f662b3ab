// Serialization of JSON, for code that includes nlohmann's JSON library.
#pragma once

#include <string>

namespace pictura {

/// Serializes JSON. Invalid UTF-8, as in file names, becomes U+FFFD. indent: spaces per level; -1: one line.
template <typename Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace pictura
