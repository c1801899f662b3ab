// Options of procedural towns, from a seed, a size and a family.
#pragma once

#include <string_view>

#include "pictura/common/rng.h"
#include "pictura/map/procedural/town_options.h"

namespace pictura::test {

inline TownOptions options_of(uint64_t seed, int blocks_x, int blocks_y, std::string_view family = "procedural") {
  TownOptions options = town_family_of(family)->defaults;
  options.seed = seed;
  options.blocks_x = blocks_x;
  options.blocks_y = blocks_y;
  return options;
}

/// Draws each option independently: its minimum, its default or its maximum.
inline TownOptions mixed_options(uint64_t seed, int blocks_x, int blocks_y, std::string_view family) {
  TownOptions options = options_of(seed, blocks_x, blocks_y, family);
  RandomStream stream({.seed = seed, .purpose = Purpose::town});
  for (const TownFeature& feature : town_features()) {
    const double values[]{feature.low, options.*feature.value, feature.high};
    options.*feature.value = values[stream.below(3)];
  }
  return options;
}

}  // namespace pictura::test
