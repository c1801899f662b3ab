// Which agent of which world each slot is, as both devices read it.
#pragma once

#include "pictura/common/span.h"

namespace pictura {

/// Which agent of which world a slot is.
struct SlotTable {
  Span<const int32_t> world_of_slot, agent_of_slot;  // [slots] index of the world; of the agent in its world
  Span<const int32_t> slot_begin;                    // [worlds + 1] the first slot of each world
  Span<const uint32_t> global_world;                 // [worlds] WorldSpec::global_world
};

}  // namespace pictura
