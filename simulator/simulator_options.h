// The options of a simulator that callers choose by name.
#pragma once

#include <iterator>

#include "pictura/common/support/named_option.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

template <typename Visitor>
void visit_options(SimulatorConfig& config, Visitor&& v) {
  v.device({"device"}, config.device);
  v.value({"seed"}, config.seed);
  v.value({"num_threads"}, config.num_threads);
  v.value({"dt_s"}, config.dt_s);
  v.value({"episode_steps"}, config.episode_steps);
  v.value({"reset_inactive_fraction"}, config.reset_inactive_fraction);
  v.value({"stagger_episodes"}, config.stagger_episodes);
  v.value({"pedestrian_fraction"}, config.pedestrian_fraction);
  v.value({"cyclist_fraction"}, config.cyclist_fraction);
  v.value({"parked_cars"}, config.parked_cars);
  v.value({"walls"}, config.walls);
  v.value({"wall_seed"}, config.wall_seed);
  v.choice({"light_heads"}, config.light_heads, kLightHeadsNames);
  v.value({"fixed_lights"}, config.fixed_lights);
  v.choice({"light_cycles"}, config.light_cycles, {kLightCyclesNames, std::size(kLightCyclesNames)});
  v.value({"reset_at_standstill"}, config.dynamics.reset_at_standstill);
  v.value({"forbid_reversing"}, config.dynamics.forbid_reversing);
  v.value({"auxiliary_observations"}, config.auxiliary_observations);
  v.value({"vector_observations"}, config.vector_observations);
  v.value({"wall_observations"}, config.wall_observations);
  v.conditioning({"conditioning"}, config.conditioning);
}

}  // namespace pictura
