#include "pictura/configuration/config_writer.h"

#include <sstream>

#include <toml++/toml.h>

namespace pictura {

std::string ConfigWriter::quoted(const std::string& value) {
  std::ostringstream out;
  out << toml::value<std::string>(value);
  return out.str();
}

void ConfigWriter::line(const NamedKey& key, const std::string& value) {
  const size_t dot = key.name.rfind('.');
  if (const std::string section = key.name.substr(0, dot); section != section_) {
    toml += fmt::format("{}[{}]\n", section_.empty() ? "" : "\n", section);
    section_ = section;
  }
  toml += fmt::format("{} = {}\n", key.name.substr(dot + 1), value);
  lines.emplace_back(key, value);
}
}  // namespace pictura
