// Options that take several maps.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pictura {

/// Adds --map, which takes names separated by commas, and may be given several times. The commas within
/// procedural:7:blocks=4x3,roundabouts=1 separate the map's options; ranges of seeds are expanded. The option takes one
/// word, so that following words belong to other arguments.
CLI::Option* add_map_list_option(CLI::App* command, std::vector<std::string>* maps, const std::string& help);

}  // namespace pictura
