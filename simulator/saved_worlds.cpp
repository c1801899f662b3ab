#include "pictura/simulator/saved_worlds.h"

#include <algorithm>

#include "pictura/common/error.h"
#include "pictura/simulator/simulator_state.h"

namespace pictura {

struct SavedWorld {
  WorldSpec spec;
  SimulatorState state;
};

namespace {

// Returns the first world of each part, and the end of the last part. The parts have about equally many agents: the
// number of agents before a part is nearest to the part's index times an equal share.
std::vector<size_t> part_begins(const std::vector<WorldSpec>& all, int num_parts) {
  const auto parts = static_cast<size_t>(num_parts);
  if (all.size() < parts) {
    fail_usage(
        "simulator: {} worlds cannot be divided over {} processes: expected at least one world per process (use more "
        "agents or smaller worlds)",
        all.size(), num_parts);
  }
  std::vector<int64_t> agents_before{0};
  for (const WorldSpec& world : all) agents_before.push_back(agents_before.back() + world.num_agents);
  std::vector<size_t> begins{0};
  for (size_t part = 1; part < parts; ++part) {
    const int64_t share = agents_before.back() * static_cast<int64_t>(part) / num_parts;
    const auto above = std::lower_bound(agents_before.begin(), agents_before.end(), share);
    auto world = static_cast<size_t>(above - agents_before.begin());
    if (world > 0 && share - agents_before[world - 1] < agents_before[world] - share) --world;
    begins.push_back(std::clamp(world, begins.back() + 1, all.size() - (parts - part)));
  }
  begins.push_back(all.size());
  return begins;
}

SimulatorSetup setup_of(const Simulator& simulator, std::vector<WorldSpec> worlds) {
  return {simulator.config(), simulator.maps(), simulator.handles(), std::move(worlds)};
}

}  // namespace

std::vector<WorldSpec> worlds_in_part(const std::vector<WorldSpec>& all, int part, int num_parts) {
  const std::vector<size_t> begins = part_begins(all, num_parts);
  const auto at = [&](int of) { return all.begin() + static_cast<int64_t>(begins[of]); };
  return {at(part), at(part + 1)};
}

std::vector<uint8_t> join_saved_states(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                       const std::vector<std::vector<uint8_t>>& parts) {
  const auto num_parts = static_cast<int>(parts.size());
  const SimulatorSetup setup = setup_of(simulator, all);
  SimulatorState joined(setup);
  int first_world = 0;
  for (int part = 0; part < num_parts; ++part) {
    const SimulatorSetup its_setup = setup_of(simulator, worlds_in_part(all, part, num_parts));
    SimulatorState its(its_setup);
    its.restore(its_setup, parts[part]);
    joined.copy_worlds(setup, first_world, its, its_setup, 0, its_setup.num_worlds());
    first_world += its_setup.num_worlds();
  }
  return joined.save(setup);
}

std::vector<uint8_t> extract_saved_part(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                        Span<const uint8_t> saved, int part, int num_parts) {
  const SimulatorSetup setup = setup_of(simulator, all),
                       its_setup = setup_of(simulator, worlds_in_part(all, part, num_parts));
  SimulatorState whole(setup), its(its_setup);
  whole.restore(setup, saved);
  its.copy_worlds(its_setup, 0, whole, setup, static_cast<int>(part_begins(all, num_parts)[part]),
                  its_setup.num_worlds());
  return its.save(its_setup);
}

std::vector<std::shared_ptr<const SavedWorld>> extract_worlds(const Simulator& simulator, Span<const uint8_t> saved,
                                                              const std::vector<size_t>& worlds) {
  const SimulatorSetup setup = setup_of(simulator, simulator.worlds());
  SimulatorState whole(setup);
  whole.restore(setup, saved);
  std::vector<std::shared_ptr<const SavedWorld>> kept;
  for (const size_t world : worlds) {
    const WorldSpec& spec = setup.worlds[world];
    const SimulatorSetup its_setup = setup_of(simulator, {spec});
    auto its = std::make_shared<SavedWorld>(SavedWorld{spec, SimulatorState(its_setup)});
    its->state.copy_worlds(its_setup, 0, whole, setup, static_cast<int>(world), 1);
    kept.push_back(std::move(its));
  }
  return kept;
}

std::vector<uint8_t> saved_state_of(const Simulator& simulator, const std::vector<const SavedWorld*>& worlds) {
  const SimulatorSetup setup = setup_of(simulator, simulator.worlds());
  PICTURA_CHECK(worlds.size() == setup.worlds.size(), "simulator state: expected {} kept worlds, got {}",
                setup.worlds.size(), worlds.size());
  SimulatorState joined(setup);
  for (size_t i = 0; i < worlds.size(); ++i) {
    const WorldSpec &expected = setup.worlds[i], &spec = worlds[i]->spec;
    const SimulatorSetup its_setup = setup_of(simulator, {spec});
    PICTURA_CHECK(
        spec.map == expected.map && spec.num_agents == expected.num_agents &&
            spec.global_world == expected.global_world && worlds[i]->state.boxes.size() == its_setup.num_boxes() &&
            worlds[i]->state.lights.size() == its_setup.num_lights(),
        "simulator state: world {}: expected world {} with {} agents on map {}, got world {} with {} on map {}", i,
        expected.global_world, expected.num_agents, expected.map, spec.global_world, spec.num_agents, spec.map);
    joined.copy_worlds(setup, static_cast<int>(i), worlds[i]->state, its_setup, 0, 1);
  }
  return joined.save(setup);
}

}  // namespace pictura
