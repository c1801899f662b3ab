// Parts of a simulator that stay constant while it steps: its configuration, maps and worlds, all checked, and the
// range of each world in the arrays.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rules/world_view.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct SimulatorSetup : SimulatorParts {
  /// Checks all input: throws UsageError for parts that cannot be simulated. handles [maps] are the handles of the maps
  /// in the scene; empty for 0, 1, ...
  SimulatorSetup(const SimulatorConfig& config, CompiledMaps maps, std::vector<GeometryHandle> handles,
                 std::vector<WorldSpec> worlds);

  /// Returns a setup with the same configuration except for the seed, and other worlds; empty handles mean 0, 1, ...
  SimulatorSetup with(CompiledMaps other_maps, std::vector<GeometryHandle> other_handles,
                      std::vector<WorldSpec> other_worlds, uint64_t seed) const;

  int num_worlds() const { return static_cast<int>(worlds.size()); }
  int num_slots() const { return slot_begin.back(); }
  size_t num_boxes() const { return static_cast<size_t>(box_begin.back()); }
  size_t num_lights() const { return static_cast<size_t>(light_begin.back()); }
  SlotTable slot_table() const { return {world_of_slot, agent_of_slot, slot_begin, global_world}; }
  const CompiledMap& map_of(int world) const { return *maps[worlds[world].map]; }
  /// Whether any map has roads that end, so that agents have lives.
  bool has_lives() const;
  /// Whether any map has replayed tracks.
  bool has_replayed_tracks() const;
  SimulatorCapacity needs() const { return capacity_of(maps, worlds); }
  /// Allocates for this capacity, so that assigning another setup within it moves no array.
  void reserve(const SimulatorCapacity& capacity);

  /// Returns a world's view, without state: its map, its range in the arrays and the keys of its random numbers.
  WorldView view(int world, const MapView& map, const RuleOptions& its_options) const;

  RuleOptions options;
  std::vector<MapView> map_views;                           // [maps] views of the maps' rules
  std::vector<int32_t> slot_begin, box_begin, light_begin;  // [worlds + 1]
  std::vector<int32_t> world_of_slot, agent_of_slot;        // [slots]
  std::vector<uint32_t> global_world;                       // [worlds]
  std::vector<GeometryHandle> geometry;                     // [worlds] handle of the world's map
};

/// Identity of the worlds of a snapshot: only a simulator with its current worlds and the snapshots of these worlds
/// hold the same token.
using WorldsToken = std::shared_ptr<const char>;
inline WorldsToken new_worlds_token() { return std::make_shared<const char>(); }

/// Side of the cells into which hosts sort a world's boxes; see HostWorlds.
constexpr float kBoxCell_m = 25.0f;
/// Numbers of cells that cover a map. 64 bits, since maps that are too large to be simulated are counted too.
struct BoxCellCounts {
  int64_t num_x, num_y;
};
BoxCellCounts count_box_cells(const MapRules& map);

}  // namespace pictura
