// Options of procedural towns, from a seed, a size and a family.
#pragma once

#include <string_view>

#include "pictura/map/procedural/town_options.h"

namespace pictura::test {

inline TownOptions options_of(uint64_t seed, int blocks_x, int blocks_y, std::string_view family = "procedural") {
  TownOptions options = town_family_of(family)->defaults;
  options.seed = seed;
  options.blocks_x = blocks_x;
  options.blocks_y = blocks_y;
  return options;
}

}  // namespace pictura::test
