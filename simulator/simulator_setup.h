// Checked configuration, maps and worlds of a simulator, and each world's range in the arrays.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rules/world_view.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct SimulatorSetup : SimulatorParts {
  /// Throws UsageError if the input cannot be simulated. handles: [maps] handles by which scenes refer to maps, or
  /// empty for 0, 1, ...
  SimulatorSetup(const SimulatorConfig& config, CompiledMaps maps, std::vector<GeometryHandle> handles,
                 std::vector<WorldSpec> worlds);

  /// Returns a setup with this configuration and another seed.
  SimulatorSetup with(CompiledMaps other_maps, std::vector<GeometryHandle> other_handles,
                      std::vector<WorldSpec> other_worlds, uint64_t seed) const;

  int num_worlds() const { return static_cast<int>(worlds.size()); }
  int num_slots() const { return slot_begin.back(); }
  size_t num_boxes() const { return static_cast<size_t>(box_begin.back()); }
  size_t num_lights() const { return static_cast<size_t>(light_begin.back()); }
  SlotTable slot_table() const { return {world_of_slot, agent_of_slot, slot_begin, global_world}; }
  const CompiledMap& map_of(int world) const { return *maps[worlds[world].map]; }
  /// Whether agents have lives: true if a map is open.
  bool has_lives() const;
  bool has_replayed_tracks() const;
  bool has_other_drivers() const { return options.others.sum() > 0; }
  SimulatorCapacity needs() const { return capacity_of(maps, worlds); }
  /// Reserves memory, so that assigning another setup within the capacity moves no array.
  void reserve(const SimulatorCapacity& capacity);

  /// Returns the view of a world, but without pointers to state.
  WorldView view(int world, const MapView& map, const RuleOptions& its_options) const;

  RuleOptions options;
  std::vector<MapView> map_views;                           // [maps]
  std::vector<int32_t> slot_begin, box_begin, light_begin;  // [worlds + 1]
  std::vector<int32_t> world_of_slot, agent_of_slot;        // [slots]
  std::vector<uint32_t> global_world;                       // [worlds]
  std::vector<GeometryHandle> geometry;                     // [worlds]
};

/// Identifies a simulator's current worlds, so that restore() rejects snapshots of earlier worlds; renewed by
/// set_worlds().
using WorldsToken = std::shared_ptr<const char>;
inline WorldsToken new_worlds_token() { return std::make_shared<const char>(); }

/// Side of the cells that sort a world's boxes; see HostWorlds.
constexpr float kBoxCell_m = 25.0f;
/// Number of cells that cover a map along x and y.
struct BoxCellCounts {
  int64_t num_x, num_y;
};
BoxCellCounts count_box_cells(const MapRules& map);

}  // namespace pictura
