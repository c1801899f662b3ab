#include "pictura/simulator/world_batch.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "pictura/common/error.h"
#include "pictura/common/hash.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {
namespace {

constexpr float kBoxCell_m = 25.0f;

void check(const SimulatorConfig& config) {
  const auto in = [](float value, float low, float high) { return value >= low && value <= high; };
  if (config.num_threads < 0) fail_usage("simulator: threads: expected 0 (all) or more, got {}", config.num_threads);
  if (!in(config.dt_s, 0.01f, 0.5f)) fail_usage("simulator: dt_s: expected 0.01 to 0.5, got {}", config.dt_s);
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
  PICTURA_CHECK(config.pedestrian_fraction == 0,
                "simulator: pedestrian_fraction: this version has no pedestrians yet, got {}",
                config.pedestrian_fraction);
  for (int i = 0; i < kNumConditioning; ++i) {
    const ConditioningRange& range = config.conditioning[static_cast<size_t>(i)];
    const bool is_positive = i == static_cast<int>(Conditioning::delta_goal_m) || i >= kNumRewardConditioning;
    if (!std::isfinite(range.low) || !std::isfinite(range.high) || range.low > range.high ||
        (is_positive && range.low <= 0) || (range.mixture && (range.low > 1 || range.high < 1))) {
      fail_usage("simulator: conditioning {}: expected finite low <= high{}{}, got {} and {}", kConditioningNames[i],
                 is_positive ? ", above 0" : "", range.mixture ? ", around 1" : "", range.low, range.high);
    }
  }
}

void check(const std::vector<std::shared_ptr<const RoadMap>>& maps, const std::vector<WorldSpec>& worlds) {
  if (maps.empty()) fail_usage("simulator: expected at least one map");
  for (const auto& map : maps) {
    if (!map) fail_usage("simulator: expected maps, got a null pointer");
  }
  if (worlds.empty()) fail_usage("simulator: expected at least one world");
  int64_t slots = 0;
  for (const WorldSpec& world : worlds) {
    if (world.map < 0 || world.map >= static_cast<int>(maps.size())) {
      fail_usage("simulator: world {}: expected a map in [0, {}), got {}", world.global_world, maps.size(), world.map);
    }
    if (world.num_agents < 1 || world.num_agents > kMaxAgentsPerWorld) {
      fail_usage("simulator: world {}: expected 1 to {} agents, got {}", world.global_world, kMaxAgentsPerWorld,
                 world.num_agents);
    }
    slots += world.num_agents;
  }
  if (slots > kMaxSlots) fail_usage("simulator: expected at most {} agents in all, got {}", kMaxSlots, slots);
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

CellLists empty_box_cells(const WorldMap& map, size_t num_boxes) {
  CellLists cells;
  cells.origin_m = map.low_m;
  cells.cell_m = kBoxCell_m;
  cells.num_x = static_cast<int>((map.high_m.x - map.low_m.x) / kBoxCell_m) + 1;
  cells.num_y = static_cast<int>((map.high_m.y - map.low_m.y) / kBoxCell_m) + 1;
  cells.begin.assign(static_cast<size_t>(cells.num_x) * static_cast<size_t>(cells.num_y) + 1, 0);
  cells.items.assign(num_boxes, 0);
  return cells;
}

}  // namespace

WorldBatch::WorldBatch(const SimulatorConfig& config_in, std::vector<std::shared_ptr<const RoadMap>> maps_in,
                       std::vector<WorldSpec> worlds_in)
    : config(config_in), maps(std::move(maps_in)), worlds(std::move(worlds_in)) {
  check(config);
  check(maps, worlds);
  options = rule_options(config);
  for (const auto& map : maps) {
    const MapGeometryOptions geometry_options{.walls = config.walls, .wall_seed = config.wall_seed};
    const std::vector<WallFace> walls = config.walls ? make_walls(*map, geometry_options) : std::vector<WallFace>{};
    world_maps.push_back(make_world_map(*map, walls));
    PICTURA_CHECK(!world_maps.back().spawn_lanes.empty(),
                  "map {}: expected a lane outside junctions from which a route goes on for ever, got none", map->name);
  }

  slot_begin = box_begin = light_begin = {0};
  for (const WorldSpec& world : worlds) {
    const WorldMap& map = world_maps[static_cast<size_t>(world.map)];
    const int num_boxes = world.num_agents + config.parked_cars;
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
  light_plans.resize(static_cast<size_t>(light_begin.back()));
  lights.resize(light_plans.size());
  episode_step.resize(worlds.size());
  episode_index = spawned = episode_step;
  episode_over.resize(worlds.size());
  world_totals.resize(worlds.size());

  reward.resize(slots);
  terminated.resize(slots);
  truncated = valid = terminated;
  views.resize(slots);
  scene.world_begin = box_begin;
  scene.agents = boxes;
  scene.geometry = geometry;
  scene.light_begin = light_begin;
  scene.light_states = lights;

  ego_.resize(slots * kEgoFeatures);
  conditioning_.resize(slots * kNumConditioning);
  waypoints_.resize(slots * kNumWaypoints * kWaypointFeatures);
  if (!config.vector_observations) return;
  partners_.resize(slots * kMaxPartners * kPartnerFeatures);
  lanes_.resize(slots * kMaxLanes * kLaneFeatures);
  boundaries_.resize(slots * kMaxBoundaries * kBoundaryFeatures);
  controls_.resize(slots * kMaxControls * kControlFeatures);
  set_counts_.resize(slots * 4);
}

WorldView WorldBatch::world(int index) {
  const auto w = static_cast<size_t>(index);
  WorldView view;
  view.map = world_maps[static_cast<size_t>(worlds[w].map)].view();
  view.options = options;
  view.seed = config.seed;
  view.global_world = worlds[w].global_world;
  view.episode = static_cast<uint32_t>(episode_index[w]);
  view.agents = agents.view();
  view.first_slot = slot_begin[w];
  view.num_agents = worlds[w].num_agents;
  view.num_boxes = box_begin[w + 1] - box_begin[w];
  view.boxes = boxes.data() + box_begin[w];
  view.boxes_before = boxes_before.data() + box_begin[w];
  view.box_cells = box_cells[w].view();
  view.light_plans = light_plans.data() + light_begin[w];
  view.lights = lights.data() + light_begin[w];
  return view;
}

ObservationView WorldBatch::observation_view() {
  return {ego_, partners_, lanes_, boundaries_, controls_, set_counts_, conditioning_, waypoints_};
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

uint64_t WorldBatch::fingerprint() const {
  Hash64 hash;
  const auto add = [&hash](const auto& value) { hash.add_bytes(&value, sizeof(value)); };
  add(config.seed);
  add(config.dt_s);
  add(config.episode_steps);
  add(config.reset_inactive_fraction);
  add(config.pedestrian_fraction);
  add(config.cyclist_fraction);
  add(config.parked_cars);
  add(config.walls);
  add(config.wall_seed);
  add(config.fixed_lights);
  for (const ConditioningRange& range : config.conditioning) {
    add(range.low);
    add(range.high);
    add(range.mixture);
  }
  for (const auto& map : maps) {
    hash.add_bytes(map->name.data(), map->name.size());
    add(map->lanes.size());
    add(map->lane_points.size());
    add(map->road_edges.size());
    add(map->lights.size());
  }
  for (const WorldSpec& world : worlds) {
    add(world.map);
    add(world.num_agents);
    add(world.global_world);
  }
  return hash.value();
}

/// Calls visit(data, bytes) for every saved array but the agents' fields.
template <typename Self, typename Visit>
void WorldBatch::visit_saved(Self& self, Visit&& visit) {
  const auto array = [&visit](auto& values) { visit(values.data(), values.size() * sizeof(*values.data())); };
  array(self.boxes);
  array(self.boxes_before);
  array(self.light_plans);
  array(self.lights);
  array(self.episode_step);
  array(self.episode_index);
  array(self.episode_over);
  array(self.spawned);
  array(self.world_totals);
}

WorldBatch::SavedHeader WorldBatch::make_header() const {
  SavedHeader header{};
  header.fingerprint = fingerprint();
  return header;
}

size_t WorldBatch::saved_bytes() const {
  size_t sum = sizeof(SavedHeader) + agents.size_bytes();
  visit_saved(*this, [&sum](const void*, size_t size) { sum += size; });
  return sum;
}

std::vector<uint8_t> WorldBatch::save() const {
  const SavedHeader header = make_header();
  std::vector<uint8_t> bytes(saved_bytes());
  std::memcpy(bytes.data(), &header, sizeof(header));
  uint8_t* next = bytes.data() + sizeof(header);
  agents.copy_to(next);
  next += agents.size_bytes();
  visit_saved(*this, [&next](const void* data, size_t size) {
    if (size > 0) std::memcpy(next, data, size);
    next += size;
  });
  return bytes;
}

void WorldBatch::restore(Span<const uint8_t> bytes) {
  const SavedHeader expected = make_header();
  SavedHeader header{};
  PICTURA_CHECK(bytes.size() >= sizeof(header), "simulator state: expected at least {} bytes, got {}", sizeof(header),
                bytes.size());
  std::memcpy(&header, bytes.data(), sizeof(header));
  PICTURA_CHECK(header.magic == expected.magic, "simulator state: these bytes are something else");
  PICTURA_CHECK(header.byte_order == expected.byte_order,
                "simulator state: written by a machine of another byte order");
  PICTURA_CHECK(header.version == expected.version, "simulator state: expected version {}, got {}", expected.version,
                header.version);
  PICTURA_CHECK(header.fingerprint == expected.fingerprint,
                "simulator state: of another configuration (seed, rules, maps or worlds differ)");
  PICTURA_CHECK(bytes.size() == saved_bytes(), "simulator state: expected {} bytes, got {}", saved_bytes(),
                bytes.size());
  const uint8_t* next = bytes.data() + sizeof(header);
  agents.assign_from(next);
  next += agents.size_bytes();
  visit_saved(*this, [&next](void* data, size_t size) {
    if (size > 0) std::memcpy(data, next, size);
    next += size;
  });
}

}  // namespace pictura
