// Names of the simulator's options.
#pragma once

#include <cstdint>
#include <iterator>
#include <limits>
#include <string>

#include "pictura/common/support/named_option.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Visits the shares of impairments, in the order of Impairment.
template <typename Shares, typename Visit>
void visit_impairments(Shares&& shares, const Visit& visit) {
  visit("blind", shares.blind);
  visit("phantom_braking", shares.phantom_braking);
  visit("inattentive", shares.inattentive);
}

/// Options of table [simulator] in configuration files.
template <typename AnyConfig, typename Visitor>
void visit_simulator_keys(AnyConfig& c, Visitor&& v) {
  v.value(NamedKey("simulator.episode_steps", Evaluation::replaced), c.episode_steps, 1, 1 << 24);
  v.value(NamedKey("simulator.reset_inactive_fraction", Evaluation::replaced), c.reset_inactive_fraction, 1e-6, 2);
  v.value(NamedKey("simulator.pedestrian_fraction"), c.pedestrian_fraction, 0, 1);
  v.value(NamedKey("simulator.cyclist_fraction"), c.cyclist_fraction, 0, 1);
  v.value(NamedKey("simulator.parked_cars"), c.parked_cars, 0, kMaxAgentsPerWorld);
  v.choice(NamedKey("simulator.light_cycles", Evaluation::replaced), c.light_cycles,
           {kLightCyclesNames, std::size(kLightCyclesNames)});
  v.value(NamedKey("simulator.walls"), c.walls);
  v.value(NamedKey("simulator.wall_seed"), c.wall_seed, 0, std::numeric_limits<int64_t>::max());
  v.choice(NamedKey("simulator.light_heads", Evaluation::replaced), c.light_heads, kLightHeadsNames);
  v.value(NamedKey("simulator.wall_observations"), c.wall_observations);
  v.value(NamedKey("simulator.dynamics.reset_at_standstill"), c.dynamics.reset_at_standstill);
  visit_impairments(c.others, [&v](const char* name, auto& share) {
    v.value(NamedKey(std::string("simulator.others.") + name, Evaluation::replaced), share, 0, 1);
  });
}

template <typename Visitor>
void visit_options(SimulatorConfig& config, Visitor&& v) {
  v.device({"device"}, config.device);
  v.value({"seed"}, config.seed);
  v.value({"num_threads"}, config.num_threads);
  v.value({"dt_s"}, config.dt_s);
  visit_simulator_keys(config, v);
  v.value({"stagger_episodes"}, config.stagger_episodes);
  v.value({"fixed_lights"}, config.fixed_lights);
  v.value({"auxiliary_observations"}, config.auxiliary_observations);
  v.value({"vector_observations"}, config.vector_observations);
  v.conditioning({"conditioning"}, config.conditioning);
}

}  // namespace pictura
