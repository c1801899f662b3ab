#include "pictura/simulator/compiled_map.h"

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/map/open_lanes.h"
#include "pictura/simulator/hash_values.h"
#include "pictura/simulator/simulator.h"

namespace pictura {
namespace {

void add_range(Hash64* hash_inout, IndexRange range) { add_values(hash_inout, range.begin, range.end); }

/// Returns a hash of all data of a road map that the simulator reads.
uint64_t fingerprint_of(const RoadMap& map) {
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

/// Returns a hash that includes the record.
uint64_t fingerprint_of(const RoadMap& map, const MapRecord& record) {
  static_assert(sizeof(RecordedAgent) == 7 * sizeof(float) && sizeof(RecordedState) == 6 * sizeof(float));
  Hash64 hash;
  add_values(&hash, fingerprint_of(map), record.num_steps);
  hash.add(Span<const RecordedAgent>(record.agents));
  hash.add(Span<const RecordedState>(record.states));
  hash.add(Span<const LightState>(record.light_states));
  return hash.value();
}

}  // namespace

std::shared_ptr<const CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options) {
  std::shared_ptr<CompiledMap> map = compile_map(std::move(road), options, MapRecord{});
  PICTURA_CHECK(!map->rules.spawn_lanes.empty(),
                "map {}: expected a driving or ramp lane with more than {} m of way ahead, got none", map->road->name,
                kMinOpenWay_m);
  return map;
}

std::shared_ptr<CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options,
                                         MapRecord record) {
  if (!road) fail_usage("simulator: expected maps, got a null pointer");
  const InterruptibleWork work(fmt::format("map {}: interrupted while it was compiled", road->name));
  auto map = std::make_shared<CompiledMap>();
  const MapGeometryOptions geometry_options{
      .walls = options.walls, .wall_seed = options.wall_seed, .light_heads = options.light_heads};
  const std::vector<WallFace> walls = options.walls ? make_walls(*road, geometry_options) : std::vector<WallFace>{};
  work.check();
  map->fingerprint = record.agents.empty() ? fingerprint_of(*road) : fingerprint_of(*road, record);
  map->rules = make_map_rules(*road, walls, options.observe_walls, std::move(record), options.observed_span_m);
  work.check();
  map->geometry = make_static_geometry(*road, geometry_options);
  map->options = options;
  map->road = std::move(road);
  return map;
}

std::vector<std::shared_ptr<const CompiledMap>> compile_maps(const std::vector<std::shared_ptr<const RoadMap>>& roads,
                                                             const MapOptions& options, int num_threads) {
  const InterruptibleWork work("interrupted while maps were compiled");
  std::vector<std::shared_ptr<const CompiledMap>> maps(roads.size());
  parallel_for(num_threads, static_cast<int64_t>(roads.size()), [&](int64_t index) {
    const auto i = static_cast<size_t>(index);
    work.check();
    maps[i] = compile_map(roads[i], options);
  });
  return maps;
}

MapOptions map_options(const SimulatorConfig& config) {
  return {config.walls, config.wall_seed, config.light_heads, config.observes(ObservationPart::walls)};
}

}  // namespace pictura
