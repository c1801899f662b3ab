// A road map in all forms that simulators and renderers read and share.
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
  bool walls = true;  // at the map's building lines
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;
  bool observe_walls = false;    // build rules.near_wall_pieces
  bool recorded_lights = false;  // lights of a recorded scene; see compile_scenario()
  // Maximum length of observed pieces of lanes and boundaries. 0, as in training: pieces are at most 10 m long and 0.25
  // m off the curve. Above 0, as in the paper's evaluation of recorded scenes: each part that is straight within 2 cm
  // is cut into equal pieces of at most this length.
  float observed_span_m = 0;
  bool operator==(const MapOptions&) const = default;
};

struct CompiledMap {
  std::shared_ptr<const RoadMap> road;
  std::shared_ptr<const Scenario> scenario;  // recorded scene of this map, or null
  int32_t start_step = 0;                    // recorded step at which episodes start
  MapOptions options;
  MapRules rules;            // for the simulator
  StaticGeometry geometry;   // for renderers
  uint64_t fingerprint = 0;  // hash of data that the simulator reads
};

/// Compiles a map. Throws Error, which names the map, if agents cannot drive or spawn on it. Throws UsageError for a
/// null pointer.
std::shared_ptr<const CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options = {});
/// Compiles a map with recorded tracks (compile_scenario()), which needs no places to spawn.
std::shared_ptr<CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options,
                                         MapRecord record);

/// Compiles on num_threads host threads (0: all).
std::vector<std::shared_ptr<const CompiledMap>> compile_maps(const std::vector<std::shared_ptr<const RoadMap>>& roads,
                                                             const MapOptions& options, int num_threads = 0);

MapOptions map_options(const SimulatorConfig& config);

}  // namespace pictura
