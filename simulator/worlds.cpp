#include <algorithm>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

std::array<ConditioningRange, kNumConditioning> SimulatorConfig::default_conditioning() {
  std::array<ConditioningRange, kNumConditioning> ranges{};
  std::copy(std::begin(kPaperConditioning), std::end(kPaperConditioning), ranges.begin());
  return ranges;
}

std::vector<WorldSpec> draw_worlds(uint64_t seed, int num_slots, int min_agents, int max_agents, int num_maps) {
  if (num_slots < 1 || num_slots > kMaxSlots) {
    fail_usage("worlds: expected 1 to {} agents in all, got {}", kMaxSlots, num_slots);
  }
  if (min_agents < 1 || max_agents > kMaxAgentsPerWorld || min_agents > max_agents) {
    fail_usage("worlds: expected 1 <= min <= max <= {} agents per world, got {} and {}", kMaxAgentsPerWorld, min_agents,
               max_agents);
  }
  if (num_maps < 1) fail_usage("worlds: expected at least one map, got {}", num_maps);
  std::vector<WorldSpec> worlds;
  for (int filled = 0; filled < num_slots;) {
    const auto index = static_cast<uint32_t>(worlds.size());
    RandomStream random({.seed = seed, .world = index, .purpose = Purpose::world_size});
    const int size = min_agents + random.below(max_agents - min_agents + 1);
    WorldSpec world;
    world.map = static_cast<int>(index % static_cast<uint32_t>(num_maps));
    world.num_agents = std::min(size, num_slots - filled);
    world.global_world = index;
    filled += world.num_agents;
    worlds.push_back(world);
  }
  return worlds;
}

}  // namespace pictura
