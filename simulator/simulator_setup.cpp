#include "pictura/simulator/simulator_setup.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {
namespace {

void check(const SimulatorConfig& config) {
  const auto in = [](float value, float low, float high) { return value >= low && value <= high; };
  if (config.num_threads < 0) fail_usage("simulator: threads: expected 0 (all) or more, got {}", config.num_threads);
  // Contact tests assume that no agent drives farther than its length in a step.
  if (!in(config.dt_s, 0.01f, kMaxStep_s)) {
    fail_usage("simulator: dt_s: expected 0.01 to {}, got {}", kMaxStep_s, config.dt_s);
  }
  if (config.episode_steps < 1)
    fail_usage("simulator: episode_steps: expected at least 1, got {}", config.episode_steps);
  if (!(config.reset_inactive_fraction > 0)) {
    fail_usage("simulator: reset_inactive_fraction: expected more than 0, got {}", config.reset_inactive_fraction);
  }
  if (!in(config.pedestrian_fraction, 0, 1) || !in(config.cyclist_fraction, 0, 1) ||
      config.pedestrian_fraction + config.cyclist_fraction > 1) {
    fail_usage("simulator: pedestrian and cyclist fractions: expected shares that sum to at most 1, got {} and {}",
               config.pedestrian_fraction, config.cyclist_fraction);
  }
  const OtherShares& others = config.others;
  const auto is_share = [&in](float share) { return in(share, 0, 1); };
  if (!is_share(others.blind) || !is_share(others.phantom_braking) || !is_share(others.inattentive) ||
      !std::all_of(std::begin(others.policies), std::end(others.policies), is_share) || !(others.sum() < 1)) {
    fail_usage(
        "simulator: others: expected shares that sum to less than 1, got blind {}, phantom_braking {}, "
        "inattentive {}, policies {}",
        others.blind, others.phantom_braking, others.inattentive, fmt::join(others.policies, ", "));
  }
  if (config.parked_cars < 0 || config.parked_cars > kMaxAgentsPerWorld) {
    fail_usage("simulator: parked_cars: expected 0 to {}, got {}", kMaxAgentsPerWorld, config.parked_cars);
  }
  for (int i = 0; i < kNumConditioning; ++i) {
    const ConditioningRange& range = config.conditioning[i];
    const bool is_positive = i == static_cast<int>(Conditioning::delta_goal_m) || i >= kNumRewardConditioning;
    if (!std::isfinite(range.low) || !std::isfinite(range.high) || range.low > range.high ||
        (is_positive && range.low <= 0) ||
        (range.mixture && range.low != range.high && (range.low > 1 || range.high < 1))) {
      fail_usage("simulator: conditioning {}: expected finite low <= high{}{}, got {} and {}", kConditioningNames[i],
                 is_positive ? ", above 0" : "", range.mixture ? ", around 1" : "", range.low, range.high);
    }
  }
}

void check(const SimulatorConfig& config, const CompiledMaps& maps, const std::vector<GeometryHandle>& handles,
           const std::vector<WorldSpec>& worlds) {
  if (maps.empty()) fail_usage("simulator: expected at least one map");
  for (const auto& map : maps) {
    if (!map) fail_usage("simulator: expected maps, got a null pointer");
    const MapOptions expected = map_options(config);
    if (map->options.walls != expected.walls || (expected.walls && map->options.wall_seed != expected.wall_seed)) {
      fail_usage("simulator: map {}: expected a map compiled with walls {}, wall seed {}; got walls {}, wall seed {}",
                 map->road->name, expected.walls, expected.wall_seed, map->options.walls, map->options.wall_seed);
    }
    if (map->options.light_heads != expected.light_heads) {
      fail_usage("simulator: map {}: expected a map compiled with light heads {}, got {}", map->road->name,
                 name_of(expected.light_heads), name_of(map->options.light_heads));
    }
    if (expected.observe_walls && !map->options.observe_walls) {
      fail_usage("simulator: map {}: expected a map compiled with observe_walls, since walls are observed",
                 map->road->name);
    }
  }
  if (handles.size() != maps.size()) {
    fail_usage("simulator: expected a handle for each of {} maps, got {}", maps.size(), handles.size());
  }
  for (const GeometryHandle handle : handles) {
    if (handle < 0 || handle >= kNumGeometryHandles) {
      fail_usage("simulator: expected handles in [0, {}), got {}", kNumGeometryHandles, handle);
    }
  }
  if (worlds.empty()) fail_usage("simulator: expected at least one world");
  for (const WorldSpec& world : worlds) {
    if (world.map < 0 || world.map >= static_cast<int>(maps.size())) {
      fail_usage("simulator: world {}: expected a map in [0, {}), got {}", world.global_world, maps.size(), world.map);
    }
    if (world.num_agents < 1 || world.num_agents > kMaxAgentsPerWorld) {
      fail_usage("simulator: world {}: expected 1 to {} agents, got {}", world.global_world, kMaxAgentsPerWorld,
                 world.num_agents);
    }
    const CompiledMap& map = *maps[world.map];
    if (!map.scenario) continue;
    const MapRecord& record = map.rules.record;
    if (record.first_replayed > 0 && world.num_agents > record.first_replayed) {
      fail_usage("simulator: world {}: expected at most {} agents, as scene {} was compiled for, got {}",
                 world.global_world, record.first_replayed, map.scenario->id, world.num_agents);
    }
    if (record.first_replayed == 0 && static_cast<size_t>(world.num_agents) != map.scenario->tracks.size()) {
      fail_usage("simulator: world {}: expected as many agents as scene {} has tracks, {}, got {}", world.global_world,
                 map.scenario->id, map.scenario->tracks.size(), world.num_agents);
    }
    constexpr float kSameStep = 0.01f;  // relative tolerance: the steps of WOMD recordings are about 0.10002 s
    if (std::abs(config.dt_s - map.scenario->dt_s) > kSameStep * map.scenario->dt_s) {
      fail_usage("simulator: dt_s: expected the {} s of scene {}, got {}", map.scenario->dt_s, map.scenario->id,
                 config.dt_s);
    }
  }
  const SimulatorCapacity needs = capacity_of(maps, worlds);
  if (needs.slots > kMaxSlots) {
    fail_usage("simulator: expected at most {} agents in all, got {}", kMaxSlots, needs.slots);
  }
  const int64_t boxes = needs.boxes(config);
  if (boxes > kMaxBoxes) {
    fail_usage(
        "simulator: expected at most {} boxes in all, got {} ({} bytes): {} agents, and {} parked cars in each of {} "
        "worlds",
        kMaxBoxes, boxes, boxes * static_cast<int64_t>(2 * sizeof(AgentBox)), needs.slots, config.parked_cars,
        needs.worlds);
  }
  if (needs.lights > kMaxBoxes) {
    fail_usage("simulator: expected at most {} traffic lights in all, got {} ({} bytes) in {} worlds", kMaxBoxes,
               needs.lights, needs.lights * static_cast<int64_t>(sizeof(LightPlan) + sizeof(LightState)), needs.worlds);
  }
}

RuleOptions rule_options(const SimulatorConfig& config) {
  RuleOptions options;
  options.dt_s = config.dt_s;
  options.episode_steps = config.episode_steps;
  options.reset_inactive_fraction = config.reset_inactive_fraction;
  options.stagger_episodes = config.stagger_episodes;
  options.after_infraction = config.after_infraction;
  options.leave_at_goal = config.leave_at_goal;
  options.pedestrian_fraction = config.pedestrian_fraction;
  options.cyclist_fraction = config.cyclist_fraction;
  options.fixed_lights = config.fixed_lights;
  options.light_cycles = config.light_cycles;
  options.dynamics = config.dynamics;
  options.others = config.others;
  options.auxiliary_observations = config.auxiliary_observations;
  std::copy(config.conditioning.begin(), config.conditioning.end(), options.conditioning);
  std::copy(std::begin(kPaperConditioning), std::end(kPaperConditioning), options.conditioning_scale);
  return options;
}

/// Throws UsageError if the box cells of all worlds would take more than a gigabyte. Each world has its own cells.
void check_box_cells(const CompiledMaps& maps, const std::vector<WorldSpec>& worlds) {
  constexpr int64_t kMaxCells = int64_t{1} << 28;
  std::vector<int64_t> cells_of_map;
  for (const auto& map : maps) {
    const BoxCellCounts cells = count_box_cells(map->rules);
    cells_of_map.push_back(cells.num_x * cells.num_y + 1);
  }
  int64_t cells = 0;
  for (const WorldSpec& world : worlds) cells += cells_of_map[world.map];
  if (cells > kMaxCells) {
    fail_usage("simulator: expected worlds of at most {} cells of {} m in all, got {} ({} bytes) in {} worlds",
               kMaxCells, kBoxCell_m, cells, cells * static_cast<int64_t>(sizeof(int32_t)), worlds.size());
  }
}

}  // namespace

LightCycles light_cycles_named(std::string_view name) {
  return static_cast<LightCycles>(
      index_of_word("light_cycles", name, {kLightCyclesNames, std::size(kLightCyclesNames)}));
}

std::string light_cycles_text(const SimulatorConfig& config, const CompiledMap& map) {
  if (map.rules.stop_lines.empty()) return "none";
  return map.rules.record.light_states.empty() ? name_of(config.light_cycles) : "recorded";
}

SimulatorCapacity SimulatorCapacity::joined(const SimulatorCapacity& other) const {
  return {std::max(worlds, other.worlds), std::max(slots, other.slots), std::max(lights, other.lights),
          std::max(maps, other.maps), std::max(map_bytes, other.map_bytes)};
}

BoxCellCounts count_box_cells(const MapRules& map) {
  return {static_cast<int64_t>((map.high_m.x - map.low_m.x) / kBoxCell_m) + 1,
          static_cast<int64_t>((map.high_m.y - map.low_m.y) / kBoxCell_m) + 1};
}

SimulatorCapacity capacity_of(const CompiledMaps& maps, const std::vector<WorldSpec>& worlds) {
  SimulatorCapacity needs;
  needs.worlds = static_cast<int64_t>(worlds.size());
  needs.maps = static_cast<int64_t>(maps.size());
  for (const WorldSpec& world : worlds) {
    needs.slots += world.num_agents;
    needs.lights += static_cast<int64_t>(maps[world.map]->rules.stop_lines.size());
  }
  for (const auto& map : maps) needs.map_bytes += map->rules.size_bytes();
  return needs;
}

SimulatorSetup::SimulatorSetup(const SimulatorConfig& config_in, CompiledMaps maps_in,
                               std::vector<GeometryHandle> handles_in, std::vector<WorldSpec> worlds_in)
    : SimulatorParts{config_in, std::move(maps_in), std::move(handles_in), std::move(worlds_in)} {
  check(config);
  if (handles.empty()) {
    handles.resize(maps.size());
    std::iota(handles.begin(), handles.end(), 0);
  }
  check(config, maps, handles, worlds);
  check_box_cells(maps, worlds);
  options = rule_options(config);
  for (const auto& map : maps) map_views.push_back(map->rules.view());
  slot_begin = box_begin = light_begin = {0};
  for (const WorldSpec& world : worlds) {
    const auto map = static_cast<size_t>(world.map);
    for (int agent = 0; agent < world.num_agents; ++agent) {
      world_of_slot.push_back(static_cast<int32_t>(global_world.size()));
      agent_of_slot.push_back(agent);
    }
    global_world.push_back(world.global_world);
    slot_begin.push_back(slot_begin.back() + world.num_agents);
    box_begin.push_back(box_begin.back() + world.num_agents + config.parked_cars);
    light_begin.push_back(light_begin.back() + static_cast<int32_t>(maps[map]->rules.stop_lines.size()));
    geometry.push_back(handles[map]);
  }
}

SimulatorSetup SimulatorSetup::with(CompiledMaps other_maps, std::vector<GeometryHandle> other_handles,
                                    std::vector<WorldSpec> other_worlds, uint64_t seed) const {
  SimulatorConfig other = config;
  other.seed = seed;
  return {other, std::move(other_maps), std::move(other_handles), std::move(other_worlds)};
}

bool SimulatorSetup::has_lives() const {
  return std::any_of(maps.begin(), maps.end(), [](const auto& map) { return map->rules.is_open; });
}

bool SimulatorSetup::has_replayed_tracks() const {
  return std::any_of(maps.begin(), maps.end(), [](const auto& map) { return map->rules.record.first_replayed > 0; });
}

void SimulatorSetup::reserve(const SimulatorCapacity& capacity) {
  for (auto* begins : {&slot_begin, &box_begin, &light_begin})
    begins->reserve(static_cast<size_t>(capacity.worlds) + 1);
  for (auto* of_slot : {&world_of_slot, &agent_of_slot}) of_slot->reserve(capacity.slots);
  global_world.reserve(capacity.worlds);
  geometry.reserve(capacity.worlds);
}

WorldView SimulatorSetup::view(int world, const MapView& map, const RuleOptions& its_options) const {
  const auto w = static_cast<size_t>(world);
  WorldView view{map, its_options};
  view.index = world;
  view.seed = config.seed;
  view.global_world = worlds[w].global_world;
  view.has_other_drivers = has_other_drivers();
  view.first_slot = slot_begin[w];
  view.num_agents = worlds[w].num_agents;
  view.first_box = box_begin[w];
  view.num_boxes = box_begin[w + 1] - box_begin[w];
  return view;
}

}  // namespace pictura
