// World and agent of each slot.
#pragma once

#include "pictura/common/span.h"

namespace pictura {

struct SlotTable {
  Span<const int32_t> world_of_slot, agent_of_slot;  // [slots] index of the world; index of the agent in its world
  Span<const int32_t> slot_begin;                    // [worlds + 1] first slot of each world
  Span<const uint32_t> global_world;                 // [worlds] WorldSpec::global_world
};

}  // namespace pictura
