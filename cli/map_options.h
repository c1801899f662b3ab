// Options that take several maps.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pictura {

/// Adds --map, which takes names with commas between them, and may be given several times. Commas within
/// procedural:7:blocks=4x3,roundabouts=1 separate options of the town, and the comma in FILE.osm@49.0,8.4 separates
/// coordinates; ranges of seeds are expanded. The option takes one word; the following words are left to other options.
CLI::Option* add_map_list_option(CLI::App* command, std::vector<std::string>* maps, const std::string& help);

}  // namespace pictura
