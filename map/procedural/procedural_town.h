// A town from a seed, as OpenDRIVE text: a grid of straight and curved streets with parking bays and sidewalks, three-
// and four-arm junctions with crosswalks and one light phase per approach (heads on the near or the far side), and a
// ring around it that may be an avenue of two lanes each way. It goes through the same importer as any other file.
#pragma once

#include <cstdint>
#include <string>

namespace pictura {

struct TownOptions {
  uint64_t seed = 0;
  int blocks_x = 3, blocks_y = 3;  // blocks of houses, in [1, 32] each
};

/// The .xodr text; equal options give equal bytes. Throws UsageError when the number of blocks is out of range.
std::string procedural_town(const TownOptions& options);

}  // namespace pictura
