// Options that take several maps.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pictura {

/// Adds --map, which takes one word with names that are separated by commas, and may be given several times. Commas in
/// a name such as procedural:7:blocks=4x3,roundabouts=1 or FILE.osm@49.0,8.4 belong to the name. Ranges of seeds are
/// expanded.
CLI::Option* add_map_list_option(CLI::App* command, std::vector<std::string>* maps, const std::string& help);

}  // namespace pictura
