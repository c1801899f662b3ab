#include "pictura/simulator/world_batch.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "pictura/common/error.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {
namespace {

constexpr float kBoxCell_m = 25.0f;

void check(const SimulatorConfig& config) {
  const auto in = [](float value, float low, float high) { return value >= low && value <= high; };
  if (config.num_threads < 0) fail_usage("simulator: threads: expected 0 (all) or more, got {}", config.num_threads);
  // Contact is looked for on the assumption that nothing drives farther in a step than it is long.
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
  if (config.parked_cars < 0 || config.parked_cars > kMaxAgentsPerWorld) {
    fail_usage("simulator: parked_cars: expected 0 to {}, got {}", kMaxAgentsPerWorld, config.parked_cars);
  }
  for (int i = 0; i < kNumConditioning; ++i) {
    const ConditioningRange& range = config.conditioning[static_cast<size_t>(i)];
    const bool is_positive = i == static_cast<int>(Conditioning::delta_goal_m) || i >= kNumRewardConditioning;
    if (!std::isfinite(range.low) || !std::isfinite(range.high) || range.low > range.high ||
        (is_positive && range.low <= 0) ||
        (range.mixture && range.low != range.high && (range.low > 1 || range.high < 1))) {
      fail_usage("simulator: conditioning {}: expected finite low <= high{}{}, got {} and {}", kConditioningNames[i],
                 is_positive ? ", above 0" : "", range.mixture ? ", around 1" : "", range.low, range.high);
    }
  }
}

void check(const SimulatorConfig& config, const std::vector<std::shared_ptr<const RoadMap>>& maps,
           const std::vector<WorldSpec>& worlds) {
  if (maps.empty()) fail_usage("simulator: expected at least one map");
  for (const auto& map : maps) {
    if (!map) fail_usage("simulator: expected maps, got a null pointer");
  }
  if (worlds.empty()) fail_usage("simulator: expected at least one world");
  int64_t slots = 0, lights = 0;
  for (const WorldSpec& world : worlds) {
    if (world.map < 0 || world.map >= static_cast<int>(maps.size())) {
      fail_usage("simulator: world {}: expected a map in [0, {}), got {}", world.global_world, maps.size(), world.map);
    }
    if (world.num_agents < 1 || world.num_agents > kMaxAgentsPerWorld) {
      fail_usage("simulator: world {}: expected 1 to {} agents, got {}", world.global_world, kMaxAgentsPerWorld,
                 world.num_agents);
    }
    slots += world.num_agents;
    lights += static_cast<int64_t>(maps[static_cast<size_t>(world.map)]->lights.size());
  }
  if (slots > kMaxSlots) fail_usage("simulator: expected at most {} agents in all, got {}", kMaxSlots, slots);
  const auto num_worlds = static_cast<int64_t>(worlds.size());
  const int64_t boxes = slots + num_worlds * config.parked_cars;
  if (boxes > kMaxBoxes) {
    fail_usage(
        "simulator: expected at most {} boxes in all, got {} ({} bytes): {} agents, and {} parked cars in each of {} "
        "worlds",
        kMaxBoxes, boxes, boxes * static_cast<int64_t>(2 * sizeof(AgentBox)), slots, config.parked_cars, num_worlds);
  }
  if (lights > kMaxBoxes) {
    fail_usage("simulator: expected at most {} traffic lights in all, got {} ({} bytes) in {} worlds", kMaxBoxes,
               lights, lights * static_cast<int64_t>(sizeof(LightPlan) + sizeof(LightState)), num_worlds);
  }
}

RuleOptions rule_options(const SimulatorConfig& config) {
  RuleOptions options;
  options.dt_s = config.dt_s;
  options.episode_steps = config.episode_steps;
  options.reset_inactive_fraction = config.reset_inactive_fraction;
  options.pedestrian_fraction = config.pedestrian_fraction;
  options.cyclist_fraction = config.cyclist_fraction;
  options.fixed_lights = config.fixed_lights;
  options.auxiliary_observations = config.auxiliary_observations;
  std::copy(config.conditioning.begin(), config.conditioning.end(), options.conditioning);
  std::copy(std::begin(kPaperConditioning), std::end(kPaperConditioning), options.conditioning_scale);
  return options;
}

/// Of one world; without room for cells and boxes yet.
CellLists box_grid(const MapRules& map) {
  CellLists cells;
  cells.origin_m = map.low_m;
  cells.cell_m = kBoxCell_m;
  cells.num_x = static_cast<int>((map.high_m.x - map.low_m.x) / kBoxCell_m) + 1;
  cells.num_y = static_cast<int>((map.high_m.y - map.low_m.y) / kBoxCell_m) + 1;
  return cells;
}

/// Throws UsageError when the worlds' box cells would take more than a gigabyte: each world has its own.
void check_box_cells(const std::vector<MapRules>& map_rules, const std::vector<WorldSpec>& worlds) {
  constexpr int64_t kMaxCells = int64_t{1} << 28;
  std::vector<int64_t> cells_of_map;
  for (const MapRules& map : map_rules) {
    const CellLists grid = box_grid(map);
    cells_of_map.push_back(int64_t{grid.num_x} * grid.num_y + 1);
  }
  int64_t cells = 0;
  for (const WorldSpec& world : worlds) cells += cells_of_map[static_cast<size_t>(world.map)];
  if (cells > kMaxCells) {
    fail_usage("simulator: expected worlds of at most {} cells of {} m in all, got {} ({} bytes) in {} worlds",
               kMaxCells, kBoxCell_m, cells, cells * static_cast<int64_t>(sizeof(int32_t)), worlds.size());
  }
}

CellLists empty_box_cells(const MapRules& map, size_t num_boxes) {
  CellLists cells = box_grid(map);
  cells.begin.assign(static_cast<size_t>(cells.num_x) * static_cast<size_t>(cells.num_y) + 1, 0);
  cells.items.assign(num_boxes, 0);
  return cells;
}

/// Hashes values that have no padding.
template <typename... Values>
void add_values(Hash64* hash_inout, const Values&... values) {
  (hash_inout->add_bytes(&values, sizeof(values)), ...);
}

void add_name(Hash64* hash_inout, const std::string& name) {
  add_values(hash_inout, name.size());
  hash_inout->add_bytes(name.data(), name.size());
}

void add_range(Hash64* hash_inout, IndexRange range) { add_values(hash_inout, range.begin, range.end); }

/// Of everything in a map that the simulator reads.
uint64_t fingerprint(const RoadMap& map) {
  static_assert(sizeof(LanePoint) == 6 * sizeof(float) && sizeof(RoadEdge) == 6 * sizeof(float));
  static_assert(sizeof(ParkingSpace) == 6 * sizeof(float) && sizeof(BuildingLine) == 6 * sizeof(float));
  Hash64 hash;
  add_name(&hash, map.name);
  for (const Lane& lane : map.lanes) {
    add_values(&hash, lane.type, lane.in_junction, lane.is_endless, lane.left_neighbor, lane.right_neighbor,
               lane.speed_limit_mps);
    add_range(&hash, lane.points);
    add_range(&hash, lane.successors);
  }
  hash.add(Span<const LanePoint>(map.lane_points));
  hash.add(Span<const int32_t>(map.lane_links));
  hash.add(Span<const RoadEdge>(map.road_edges));
  hash.add(Span<const ParkingSpace>(map.parking_spaces));
  hash.add(Span<const BuildingLine>(map.building_lines));
  for (const Crosswalk& crosswalk : map.crosswalks) add_range(&hash, crosswalk.outline);
  hash.add(Span<const Vec3>(map.outline_points));
  for (const TrafficLight& light : map.lights) {
    add_values(&hash, light.stop_a_m, light.stop_b_m, light.stop_heading_rad, light.junction, light.phase);
    add_range(&hash, light.lanes);
  }
  hash.add(Span<const int32_t>(map.light_lanes));
  for (const Junction& junction : map.junctions) add_values(&hash, junction.num_phases);
  return hash.value();
}

/// What a saved state must have in common with the simulator that restores it, by the names that a mismatch is told by.
struct Fingerprint {
  std::string name;
  uint64_t value = 0;
};

std::vector<Fingerprint> fingerprints(const WorldBatch& batch) {
  std::vector<Fingerprint> prints;
  const auto add = [&prints](std::string name, const auto&... values) {
    Hash64 hash;
    add_values(&hash, values...);
    prints.push_back({std::move(name), hash.value()});
  };
  const SimulatorConfig& config = batch.config;
  add("seed", config.seed);
  add("time (dt_s, episode_steps, reset_inactive_fraction)", config.dt_s, config.episode_steps,
      config.reset_inactive_fraction);
  add("population (pedestrian_fraction, cyclist_fraction, parked_cars)", config.pedestrian_fraction,
      config.cyclist_fraction, config.parked_cars);
  add("walls (walls, wall_seed)", config.walls, config.wall_seed);
  add("fixed_lights", config.fixed_lights);
  Hash64 conditioning, worlds;
  for (const ConditioningRange& range : config.conditioning) {
    add_values(&conditioning, range.low, range.high, range.mixture);
  }
  prints.push_back({"conditioning", conditioning.value()});
  for (const WorldSpec& world : batch.worlds) add_values(&worlds, world.map, world.num_agents, world.global_world);
  prints.push_back({"worlds", worlds.value()});
  add("number of maps", batch.maps.size());
  for (const auto& map : batch.maps) prints.push_back({fmt::format("map {}", map->name), fingerprint(*map)});
  return prints;
}

bool all_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}
template <typename Integer>
bool all_finite(const std::vector<Integer>&) {
  return true;
}

/// Throws Error naming the field unless every value can be stepped on: indices exist and numbers are finite.
void check_restored(const WorldBatch& batch) {
  constexpr float kMaxCoordinate_m = 1e6f;
  const AgentState& agents = batch.agents;
#define X(name, type, per_agent, first, comment) \
  PICTURA_CHECK(all_finite(agents.name), "simulator state: {}: expected finite numbers", #name);
  PICTURA_AGENT_FIELDS(X)
#undef X
  const auto expect = [](bool is_sound, size_t slot, const char* field, auto value) {
    PICTURA_CHECK(is_sound, "simulator state: agent {}: {}: {} is out of range", slot, field, value);
  };
  for (size_t w = 0; w < batch.worlds.size(); ++w) {
    const MapRules& map = batch.map_rules[static_cast<size_t>(batch.worlds[w].map)];
    const std::vector<MapLane>& lanes = map.lanes;
    const auto num_walk_pieces = static_cast<int32_t>(map.walkways.pieces.size());
    const auto is_lane = [&lanes](int32_t lane) {
      return lane >= 0 && static_cast<size_t>(lane) < lanes.size() && lanes[static_cast<size_t>(lane)].num_segments > 0;
    };
    for (auto slot = static_cast<size_t>(batch.slot_begin[w]); slot < static_cast<size_t>(batch.slot_begin[w + 1]);
         ++slot) {
      const auto status = static_cast<AgentStatus>(agents.status[slot]);
      expect(status == AgentStatus::active || status == AgentStatus::halted || status == AgentStatus::absent, slot,
             "status", static_cast<int>(status));
      expect(agents.agent_class[slot] < kNumAgentClasses, slot, "agent_class",
             static_cast<int>(agents.agent_class[slot]));
      expect(agents.lane[slot] == -1 || is_lane(agents.lane[slot]), slot, "lane", agents.lane[slot]);
      const int32_t goal_lane = agents.goal_lane[slot];
      const bool is_way = agents.agent_class[slot] == static_cast<uint8_t>(AgentClass::pedestrian)
                              ? goal_lane >= 0 && goal_lane < num_walk_pieces
                              : is_lane(goal_lane);
      expect(is_way || (goal_lane == -1 && status == AgentStatus::absent), slot, "goal_lane", goal_lane);
      expect(agents.next_waypoint[slot] >= 0 && agents.next_waypoint[slot] < kNumWaypoints, slot, "next_waypoint",
             agents.next_waypoint[slot]);
      expect(agents.goal_chains[slot] >= 0, slot, "goal_chains", agents.goal_chains[slot]);
      expect(std::fabs(agents.x_m[slot]) <= kMaxCoordinate_m, slot, "x_m", agents.x_m[slot]);
      expect(std::fabs(agents.y_m[slot]) <= kMaxCoordinate_m, slot, "y_m", agents.y_m[slot]);
    }
    PICTURA_CHECK(batch.spawned[w] >= 0 && batch.spawned[w] <= batch.worlds[w].num_agents,
                  "simulator state: world {}: spawned: {} is out of range", w, batch.spawned[w]);
    PICTURA_CHECK(batch.episode_step[w] >= 0 && batch.episode_step[w] <= batch.config.episode_steps,
                  "simulator state: world {}: episode_step: {} is out of range", w, batch.episode_step[w]);
    PICTURA_CHECK(batch.episode_index[w] >= 0, "simulator state: world {}: episode_index: {} is out of range", w,
                  batch.episode_index[w]);
  }
  for (const std::vector<AgentBox>* boxes : {&batch.boxes, &batch.boxes_before}) {
    for (size_t i = 0; i < boxes->size(); ++i) {
      const AgentBox& box = (*boxes)[i];
      const Vec3 at = box.center_m;
      // Comparisons are false for what is not a number.
      PICTURA_CHECK(std::fabs(at.x) <= kMaxCoordinate_m && std::fabs(at.y) <= kMaxCoordinate_m &&
                        std::fabs(at.z) <= kMaxCoordinate_m && std::fabs(box.cos_heading) <= 1.001f &&
                        std::fabs(box.sin_heading) <= 1.001f && box.length_m >= 0 && box.width_m >= 0 &&
                        box.height_m >= 0 && radius(box) <= kMaxBoxRadius_m && box.height_m <= kMaxCoordinate_m &&
                        static_cast<int>(box.agent_class) < kNumAgentClasses,
                    "simulator state: boxes: box {}: pose, size or class is out of range", i);
    }
  }
  for (size_t i = 0; i < batch.light_plans.size(); ++i) {
    const LightPlan& plan = batch.light_plans[i];
    const int64_t slot_steps = int64_t{plan.green_steps} + plan.yellow_steps + plan.red_steps;
    PICTURA_CHECK(plan.green_steps >= 0 && plan.yellow_steps >= 0 && plan.red_steps >= 0 && slot_steps >= 1 &&
                      plan.num_phases >= 1 && plan.phase >= 0 && plan.offset_steps >= 0 &&
                      plan.offset_steps < slot_steps * plan.num_phases && slot_steps * plan.num_phases <= INT32_MAX / 2,
                  "simulator state: light_plans: light {}: the plan is out of range", i);
    PICTURA_CHECK(batch.lights[i] <= LightState::green, "simulator state: lights: light {}: {} is out of range", i,
                  static_cast<int>(batch.lights[i]));
  }
}

}  // namespace

WorldBatch::WorldBatch(const SimulatorConfig& config_in, std::vector<std::shared_ptr<const RoadMap>> maps_in,
                       std::vector<WorldSpec> worlds_in)
    : config(config_in), maps(std::move(maps_in)), worlds(std::move(worlds_in)) {
  check(config);
  check(config, maps, worlds);
  options = rule_options(config);
  map_rules.resize(maps.size());
  parallel_for(config.num_threads, static_cast<int64_t>(maps.size()), [this](int64_t index) {
    const RoadMap& map = *maps[static_cast<size_t>(index)];
    MapRules& world_map = map_rules[static_cast<size_t>(index)];
    const MapGeometryOptions geometry_options{.walls = config.walls, .wall_seed = config.wall_seed};
    const std::vector<WallFace> walls = config.walls ? make_walls(map, geometry_options) : std::vector<WallFace>{};
    world_map = make_map_rules(map, walls, config.observes(ObservationPart::walls));
    PICTURA_CHECK(!world_map.spawn_lanes.empty(),
                  "map {}: expected a lane outside junctions from which a route goes on for ever, got none", map.name);
  });

  for (const MapRules& map : map_rules) map_views.push_back(map.view());
  check_box_cells(map_rules, worlds);
  slot_begin = box_begin = light_begin = {0};
  for (const WorldSpec& world : worlds) {
    const MapRules& map = map_rules[static_cast<size_t>(world.map)];
    const int num_boxes = world.num_agents + config.parked_cars;
    for (int agent = 0; agent < world.num_agents; ++agent) {
      world_of_slot.push_back(static_cast<int32_t>(global_world.size()));
      agent_of_slot.push_back(agent);
    }
    global_world.push_back(world.global_world);
    slot_begin.push_back(slot_begin.back() + world.num_agents);
    box_begin.push_back(box_begin.back() + num_boxes);
    light_begin.push_back(light_begin.back() + static_cast<int32_t>(map.stop_lines.size()));
    geometry.push_back(world.map);
    box_cells.push_back(empty_box_cells(map, static_cast<size_t>(num_boxes)));
  }
  const auto slots = static_cast<size_t>(num_slots());
  agents = AgentState(slots);
  boxes.resize(static_cast<size_t>(box_begin.back()));
  boxes_before = boxes;
  cell_centers.resize(boxes.size());
  light_plans.resize(static_cast<size_t>(light_begin.back()));
  lights.resize(light_plans.size());
  episode_step.resize(worlds.size());
  episode_index = spawned = episode_step;
  episode_over.resize(worlds.size());
  world_totals.resize(worlds.size());

  scene.world_begin = box_begin;
  scene.agents = boxes;
  scene.geometry = geometry;
  scene.light_begin = light_begin;
  scene.light_states = lights;
}

WorldView WorldBatch::world(int index) {
  return world(index, map_views[static_cast<size_t>(worlds[static_cast<size_t>(index)].map)], options);
}

WorldView WorldBatch::world(int index, const MapView& map, const RuleOptions& its_options) {
  const auto w = static_cast<size_t>(index);
  WorldView view{map, its_options};
  view.index = index;
  view.seed = config.seed;
  view.global_world = worlds[w].global_world;
  view.episode = static_cast<uint32_t>(episode_index[w]);
  view.agents = agents.view();
  view.first_slot = slot_begin[w];
  view.num_agents = worlds[w].num_agents;
  view.first_box = box_begin[w];
  view.num_boxes = box_begin[w + 1] - box_begin[w];
  view.boxes = boxes.data() + box_begin[w];
  view.boxes_before = boxes_before.data() + box_begin[w];
  view.box_cells = box_cells[w].view();
  view.cell_centers = cell_centers.data() + box_begin[w];
  view.light_plans = light_plans.data() + light_begin[w];
  view.lights = lights.data() + light_begin[w];
  return view;
}

SpawnReport WorldBatch::spawn_report() const {
  SpawnReport report;
  report.asked = num_slots();
  report.spawned = std::accumulate(spawned.begin(), spawned.end(), int64_t{0});
  const auto refused_for = [this](SpawnFailure reason) {
    return std::count(agents.refusal.begin(), agents.refusal.end(), static_cast<uint8_t>(reason));
  };
  report.refused_no_place = refused_for(SpawnFailure::no_place);
  report.refused_taken = refused_for(SpawnFailure::taken);
  report.refused = report.refused_no_place + report.refused_taken;
  report.parked_asked = int64_t{num_worlds()} * config.parked_cars;
  for (size_t w = 0; w < worlds.size(); ++w) {
    report.parked_placed +=
        std::count_if(boxes.begin() + box_begin[w] + worlds[w].num_agents, boxes.begin() + box_begin[w + 1],
                      [](const AgentBox& box) { return box.drawn != 0; });
  }
  return report;
}

SimulatorTotals WorldBatch::totals() const {
  SimulatorTotals sum;
  for (const SimulatorTotals& part : world_totals) sum.add(part);
  return sum;
}

std::vector<StaticGeometry> WorldBatch::geometries() const {
  std::vector<StaticGeometry> geometries;
  const MapGeometryOptions geometry_options{.walls = config.walls, .wall_seed = config.wall_seed};
  for (const auto& map : maps) geometries.push_back(make_static_geometry(*map, geometry_options));
  return geometries;
}

uint64_t WorldBatch::state_hash() const {
  Hash64 hash;
  agents.add_to(&hash);
  hash.add(Span<const LightState>(lights));
  for (size_t w = 0; w < worlds.size(); ++w) {
    const int first_parked = box_begin[w] + worlds[w].num_agents;
    hash.add(Span<const AgentBox>(boxes.data() + first_parked, static_cast<size_t>(box_begin[w + 1] - first_parked)));
  }
  return hash.value();
}

size_t WorldBatch::saved_bytes() const {
  size_t sum = agents.size_bytes();
  visit_state(*this, *this, [&sum](const auto& array, const auto&) { sum += array.size() * sizeof(*array.data()); });
  return sum;
}

void WorldBatch::assign_from(const uint8_t* bytes) {
  agents.assign_from(bytes);
  bytes += agents.size_bytes();
  visit_state(*this, *this, [&bytes](auto& array, auto&) {
    const size_t size = array.size() * sizeof(*array.data());
    if (size > 0) std::memcpy(array.data(), bytes, size);
    bytes += size;
  });
}

void WorldBatch::copy_to(uint8_t* bytes_out) const {
  agents.copy_to(bytes_out);
  bytes_out += agents.size_bytes();
  visit_state(*this, *this, [&bytes_out](const auto& array, const auto&) {
    const size_t size = array.size() * sizeof(*array.data());
    if (size > 0) std::memcpy(bytes_out, array.data(), size);
    bytes_out += size;
  });
}

std::vector<uint8_t> WorldBatch::save() const {
  const std::vector<Fingerprint> prints = fingerprints(*this);
  SavedHeader header;
  header.num_fingerprints = prints.size();
  const size_t prints_bytes = prints.size() * sizeof(uint64_t);
  std::vector<uint8_t> bytes(sizeof(header) + prints_bytes + saved_bytes());
  std::memcpy(bytes.data(), &header, sizeof(header));
  for (size_t i = 0; i < prints.size(); ++i) {
    std::memcpy(bytes.data() + sizeof(header) + i * sizeof(uint64_t), &prints[i].value, sizeof(uint64_t));
  }
  copy_to(bytes.data() + sizeof(header) + prints_bytes);
  return bytes;
}

void WorldBatch::restore(Span<const uint8_t> bytes) {
  const SavedHeader expected;
  SavedHeader header;
  PICTURA_CHECK(bytes.size() >= sizeof(header), "simulator state: expected at least {} bytes, got {}", sizeof(header),
                bytes.size());
  std::memcpy(&header, bytes.data(), sizeof(header));
  PICTURA_CHECK(header.magic == expected.magic, "simulator state: these bytes are something else");
  PICTURA_CHECK(header.byte_order == expected.byte_order,
                "simulator state: written by a machine of another byte order");
  PICTURA_CHECK(header.version == expected.version, "simulator state: expected version {}, got {}", expected.version,
                header.version);
  const std::vector<Fingerprint> prints = fingerprints(*this);
  for (size_t i = 0; i < prints.size(); ++i) {
    const size_t at = sizeof(header) + i * sizeof(uint64_t);
    PICTURA_CHECK(bytes.size() >= at + sizeof(uint64_t),
                  "simulator state: ends within its fingerprints, after {} bytes", bytes.size());
    uint64_t saved = 0;
    std::memcpy(&saved, bytes.data() + at, sizeof(saved));
    PICTURA_CHECK(saved == prints[i].value, "simulator state: saved with another {}", prints[i].name);
  }
  PICTURA_CHECK(header.num_fingerprints == prints.size(), "simulator state: expected {} fingerprints, got {}",
                prints.size(), header.num_fingerprints);
  const size_t begin = sizeof(header) + prints.size() * sizeof(uint64_t);
  PICTURA_CHECK(bytes.size() == begin + saved_bytes(), "simulator state: expected {} bytes, got {}",
                begin + saved_bytes(), bytes.size());

  std::vector<uint8_t> present(saved_bytes());
  copy_to(present.data());
  assign_from(bytes.data() + begin);
  try {
    check_restored(*this);
  } catch (const Error&) {
    assign_from(present.data());
    throw;
  }
}

std::string rejection_text(int64_t rejected) {
  const int64_t slot = rejected >> 32 & 0x0FFFFFFF;
  switch (static_cast<CommandKind>(rejected >> 60)) {
    case CommandKind::action:
      return fmt::format("slot {}: expected an action in [0, {}), got {}", slot, kNumActions,
                         static_cast<int32_t>(rejected));
    case CommandKind::kinematic_state:
      return fmt::format("slot {}: expected a kinematic state within {} m, {} rad and {} m/s, got one beyond", slot,
                         kMaxCommanded_m, kMaxCommanded_rad, kMaxCommanded_mps);
    default: return fmt::format("slot {}: expected a command that is an action, a kinematic state or absence", slot);
  }
}

HostResults::HostResults(size_t num_slots, const SimulatorConfig& config)
    : reward(num_slots),
      terminated(num_slots),
      truncated(num_slots),
      valid(num_slots),
      views(num_slots){
#define X(name, type, per_slot, part, comment) \
  if (config.observes(part)) name##_.resize(num_slots* static_cast<size_t>(per_slot));
          PICTURA_OBSERVATION_ARRAYS(X)
#undef X
      }

      ObservationView HostResults::observation_view() {
#define X(name, type, per_slot, part, comment) name##_,
  return {PICTURA_OBSERVATION_ARRAYS(X)};
#undef X
}

}  // namespace pictura
