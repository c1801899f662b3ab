// What a simulator is made of and does not change while it steps: its configuration, maps and worlds, all checked, and
// where each world's part of the arrays begins.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rules/world_view.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct SimulatorSetup : SimulatorParts {
  /// Checks everything that comes from outside: throws UsageError for what cannot be simulated. handles [maps] are what
  /// the scene names the maps by; empty for 0, 1, ...
  SimulatorSetup(const SimulatorConfig& config, CompiledMaps maps, std::vector<GeometryHandle> handles,
                 std::vector<WorldSpec> worlds);

  /// The same configuration but for the seed, over other worlds; handles may be empty, for 0, 1, ...
  SimulatorSetup with(CompiledMaps other_maps, std::vector<GeometryHandle> other_handles,
                      std::vector<WorldSpec> other_worlds, uint64_t seed) const;

  int num_worlds() const { return static_cast<int>(worlds.size()); }
  int num_slots() const { return slot_begin.back(); }
  size_t num_boxes() const { return static_cast<size_t>(box_begin.back()); }
  size_t num_lights() const { return static_cast<size_t>(light_begin.back()); }
  SlotTable slot_table() const { return {world_of_slot, agent_of_slot, slot_begin, global_world}; }
  const CompiledMap& map_of(int world) const { return *maps[worlds[world].map]; }
  /// Whether any of the maps has roads that end, so that agents have lives.
  bool has_lives() const;
  SimulatorCapacity needs() const { return capacity_of(maps, worlds); }
  /// Allocates for as many worlds, slots and so on, so that assigning another setup within it moves no array.
  void reserve(const SimulatorCapacity& capacity);

  /// A view of a world without state: its map, its place in the arrays and the keys of its random numbers.
  WorldView view(int world, const MapView& map, const RuleOptions& its_options) const;

  RuleOptions options;
  std::vector<MapView> map_views;                           // [maps] of their rules
  std::vector<int32_t> slot_begin, box_begin, light_begin;  // [worlds + 1]
  std::vector<int32_t> world_of_slot, agent_of_slot;        // [slots]
  std::vector<uint32_t> global_world;                       // [worlds]
  std::vector<GeometryHandle> geometry;                     // [worlds] the handle of its map
};

/// Tells whose a snapshot is: a simulator with its present worlds and their snapshots hold the same one, and nobody
/// else.
using WorldsToken = std::shared_ptr<const char>;
inline WorldsToken new_worlds_token() { return std::make_shared<const char>(); }

/// Sides of the cells that hosts sort a world's boxes into; see HostWorlds.
constexpr float kBoxCell_m = 25.0f;
/// How many cells cover a map. Of 64 bits, since a map that is too large to be simulated is counted too.
struct BoxCellCounts {
  int64_t num_x, num_y;
};
BoxCellCounts count_box_cells(const MapRules& map);

}  // namespace pictura
