#include "pictura/bench/driving.h"

#include <algorithm>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/drive_steps.h"

namespace pictura {

void step_randomly(Simulator* simulator, uint64_t seed, int steps) {
  const auto controller = make_controller("random", *simulator, seed);
  if (drive_steps(*simulator, *controller, steps).is_interrupted) throw_if_interrupted();
}

DrivenWorlds drive_worlds(const DrivenOptions& options) {
  SimulatorConfig config = options.simulator;
  config.fixed_lights = true;
  config.vector_observations = false;
  std::vector<std::shared_ptr<const RoadMap>> maps;
  for (const std::string& name : options.maps) maps.push_back(load_map(name));
  const int num_maps = static_cast<int>(maps.size());
  // An eighth more agents than views, because not every agent can be spawned.
  const int wanted = options.num_views + options.num_views / 8;
  const int num_worlds = options.num_views > 0 ? (wanted + options.agents - 1) / options.agents : num_maps;
  std::vector<WorldSpec> specs;
  for (int i = 0; i < num_worlds; ++i) specs.push_back({i % num_maps, options.agents, static_cast<uint32_t>(i)});

  DrivenWorlds worlds;
  worlds.simulator = make_simulator("cpu", config, maps, specs);
  step_randomly(worlds.simulator.get(), config.seed, options.steps);
  const SpawnFailure* refusal = worlds.simulator->state().refusal;
  const Span<const View> views = worlds.simulator->views();
  for (int agent = 0; agent < options.agents; ++agent) {
    for (int world = 0; world < num_worlds; ++world) {
      const auto slot = static_cast<std::size_t>(world * options.agents + agent);
      if (refusal[slot] == SpawnFailure::none) worlds.views.push_back(views[slot]);
    }
  }
  const int expected = std::max(1, options.num_views);
  PICTURA_CHECK(static_cast<int>(worlds.views.size()) >= expected,
                "bench: expected {} agents, but only {} of {} found a place", expected, worlds.views.size(),
                views.size());
  if (options.num_views > 0) worlds.views.resize(options.num_views);
  return worlds;
}

}  // namespace pictura
