// Options that take several maps.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pictura {

/// Adds --map, which takes names separated by commas and may be given repeatedly. Commas within names such as
/// FILE.osm@49.0,8.4 are kept. Seed ranges are expanded.
CLI::Option* add_map_list_option(CLI::App* command, std::vector<std::string>* maps, const std::string& help);

}  // namespace pictura
