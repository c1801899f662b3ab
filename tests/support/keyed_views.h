// Views with keys of a simulator's agents.
#pragma once

#include <vector>

#include "pictura/common/scene_types.h"

namespace pictura::test {

/// Sets keys of several agents, worlds, episodes and steps.
inline std::vector<View> keyed(std::vector<View> views) {
  for (uint32_t i = 0; i < views.size(); ++i) {
    views[i].key = {.world = 0x80000000u + i / 3, .agent = 17 * i, .episode = i % 2, .step = 40 + i};
  }
  return views;
}

}  // namespace pictura::test
