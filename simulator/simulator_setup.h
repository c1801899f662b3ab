// Data of a simulator that stay constant while it steps: its configuration, maps and worlds, all checked, and the range
// of each world in the arrays.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rules/world_view.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct SimulatorSetup : SimulatorParts {
  /// Checks the input and throws UsageError if it cannot be simulated. handles: [maps] handles by which scenes refer to
  /// maps, or empty for 0, 1, ...
  SimulatorSetup(const SimulatorConfig& config, CompiledMaps maps, std::vector<GeometryHandle> handles,
                 std::vector<WorldSpec> worlds);

  /// Returns a setup with other maps and worlds, and the same configuration with another seed. Empty handles mean 0, 1,
  /// ...
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
  /// Allocates for this capacity. Assigning another setup within the capacity then moves no array.
  void reserve(const SimulatorCapacity& capacity);

  /// Returns the WorldView of a world with its map, its range in the arrays and the keys of its random numbers.
  /// Pointers to state are not set.
  WorldView view(int world, const MapView& map, const RuleOptions& its_options) const;

  RuleOptions options;
  std::vector<MapView> map_views;                           // [maps] views of the maps' rules
  std::vector<int32_t> slot_begin, box_begin, light_begin;  // [worlds + 1]
  std::vector<int32_t> world_of_slot, agent_of_slot;        // [slots]
  std::vector<uint32_t> global_world;                       // [worlds]
  std::vector<GeometryHandle> geometry;                     // [worlds] handle of the world's map
};

/// Token that identifies a simulator's current worlds. A snapshot holds the token of its worlds; set_worlds() makes a
/// new token, so that older snapshots no longer match.
using WorldsToken = std::shared_ptr<const char>;
inline WorldsToken new_worlds_token() { return std::make_shared<const char>(); }

/// Side of the square cells into which a world's boxes are sorted; see HostWorlds.
constexpr float kBoxCell_m = 25.0f;
/// Numbers of cells that cover a map. They have 64 bits, because cells are also counted for maps that are too large to
/// be simulated.
struct BoxCellCounts {
  int64_t num_x, num_y;
};
BoxCellCounts count_box_cells(const MapRules& map);

}  // namespace pictura
