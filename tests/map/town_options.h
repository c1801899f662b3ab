// Procedural towns of a seed and a size.
#pragma once

#include "pictura/map/procedural/town_options.h"

namespace pictura::test {

inline TownOptions options_of(uint64_t seed, int blocks_x, int blocks_y) {
  TownOptions options;
  options.seed = seed;
  options.blocks_x = blocks_x;
  options.blocks_y = blocks_y;
  return options;
}

}  // namespace pictura::test
