// A road map in all the forms that simulators and renderers read, compiled once and shared by all of them.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/scene.h"
#include "pictura/map/map_geometry.h"
#include "pictura/map/road_map.h"
#include "pictura/simulator/map_rules.h"

namespace pictura {

struct Scenario;
struct SimulatorConfig;

struct MapOptions {
  bool walls = true;  // along the building lines
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;
  bool observe_walls = false;    // rules.near_wall_pieces is made
  bool recorded_lights = false;  // those of a recorded scene are there, see compile_scenario()
  // How long observed pieces of lanes and boundaries are. 0: at most 10 m, and they follow curves within 0.25 m, as in
  // training. Above 0: what is straight within 2 cm, however long, is cut evenly into pieces of at most so many metres
  // (paper, evaluation protocol: on logged maps long segments are subdivided at observation time).
  float observed_span_m = 0;
  bool operator==(const MapOptions&) const = default;
};

struct CompiledMap {
  std::shared_ptr<const RoadMap> road;
  std::shared_ptr<const Scenario> scenario;  // the recorded scene that it is the map of, or null
  int32_t start_step = 0;                    // of the recording, at which episodes start
  MapOptions options;
  MapRules rules;            // what the simulator's rules read
  StaticGeometry geometry;   // what renderers draw
  uint64_t fingerprint = 0;  // of everything in the road map that the simulator reads
};

/// Throws Error naming the map when agents cannot drive on it, or can nowhere spawn; UsageError for a null pointer.
std::shared_ptr<const CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options = {});
/// The same with what was recorded there, so that nobody spawns; see compile_scenario().
std::shared_ptr<CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options,
                                         MapRecord record);

/// Several, by num_threads host threads (0: all).
std::vector<std::shared_ptr<const CompiledMap>> compile_maps(const std::vector<std::shared_ptr<const RoadMap>>& roads,
                                                             const MapOptions& options, int num_threads = 0);

/// Those that a simulator of this configuration needs.
MapOptions map_options(const SimulatorConfig& config);

}  // namespace pictura
