// A road map in all forms that simulators and renderers read. A map is compiled once; simulators and renderers share
// the result.
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
  bool walls = true;  // whether walls stand along the map's building lines
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;
  bool observe_walls = false;    // make walls observable: build rules.near_wall_pieces
  bool recorded_lights = false;  // include the lights of a recorded scene; see compile_scenario()
  // Maximum length of observed pieces of lanes and boundaries. 0: as in training, pieces are at most 10 m long and
  // deviate at most 0.25 m from curves. Above 0: each part that is straight within 2 cm is cut evenly into pieces of at
  // most this length, as in the paper's evaluation of recorded scenes.
  float observed_span_m = 0;
  bool operator==(const MapOptions&) const = default;
};

struct CompiledMap {
  std::shared_ptr<const RoadMap> road;
  std::shared_ptr<const Scenario> scenario;  // the recorded scene of this map, or null
  int32_t start_step = 0;                    // time step of the recorded scene at which episodes start
  MapOptions options;
  MapRules rules;            // data that the simulator's rules read
  StaticGeometry geometry;   // data that renderers draw
  uint64_t fingerprint = 0;  // hash of all road-map data that the simulator reads
};

/// Compiles a map. Throws Error, which names the map, if agents cannot drive on it or have no place to spawn. Throws
/// UsageError for a null pointer.
std::shared_ptr<const CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options = {});
/// Compiles a map with recorded tracks. Agents then start where their records start, so the map needs no places to
/// spawn; see compile_scenario().
std::shared_ptr<CompiledMap> compile_map(std::shared_ptr<const RoadMap> road, const MapOptions& options,
                                         MapRecord record);

/// Compiles several maps on num_threads host threads (0: all).
std::vector<std::shared_ptr<const CompiledMap>> compile_maps(const std::vector<std::shared_ptr<const RoadMap>>& roads,
                                                             const MapOptions& options, int num_threads = 0);

/// Returns the map options that a simulator of this configuration needs.
MapOptions map_options(const SimulatorConfig& config);

}  // namespace pictura
