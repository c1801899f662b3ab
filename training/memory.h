// Whether a configuration's agents fit into memory, before anything is made.
#pragma once

#include "pictura/training/config.h"

namespace pictura {

/// What simulator, rollout and update take for all agents of a configuration, by estimate: what grows with
/// simulator.num_slots, so neither maps nor the network, whose own grows with train.forward_chunk.
double estimated_bytes(const Config& config, Device device);

/// Throws Error naming the settings that decide, and how many agents would fit, where the estimate exceeds
/// `memory_bytes` of the device; with several ranks, for each one's part.
void check_memory(const Config& config, Device device, int64_t memory_bytes, int num_ranks = 1);

}  // namespace pictura
