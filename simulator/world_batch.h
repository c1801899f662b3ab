// The state of a simulator on the host: everything that is saved, sized once, with each world's part of it as a
// WorldView. An executor on the host runs the rules over it; one on a device mirrors it there. Checking, saving,
// restoring and hashing are the same for all.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "pictura/simulator/agent_state.h"
#include "pictura/simulator/map_rules.h"
#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct WorldBatch {
  /// Checks everything that comes from outside: throws UsageError for what cannot be asked for, Error naming the map
  /// for one that no world can run on.
  WorldBatch(const SimulatorConfig& config, std::vector<std::shared_ptr<const RoadMap>> maps,
             std::vector<WorldSpec> worlds);
  WorldBatch(const WorldBatch&) = delete;
  WorldBatch& operator=(const WorldBatch&) = delete;

  int num_worlds() const { return static_cast<int>(worlds.size()); }
  int num_slots() const { return slot_begin.back(); }
  WorldView world(int index);
  /// The same over another copy of its map and of `options`.
  WorldView world(int index, const MapView& map, const RuleOptions& its_options);
  SpawnReport spawn_report() const;
  SimulatorTotals totals() const;
  std::vector<StaticGeometry> geometries() const;
  SlotTable slot_table() const { return {world_of_slot, agent_of_slot, slot_begin, global_world}; }

  uint64_t state_hash() const;
  std::vector<uint8_t> save() const;
  /// Throws Error, and leaves everything as it was, when the bytes are of another simulator, naming what differs, or
  /// when a field holds what no simulator saved.
  void restore(Span<const uint8_t> bytes);

  SimulatorConfig config;
  std::vector<std::shared_ptr<const RoadMap>> maps;
  std::vector<WorldSpec> worlds;
  RuleOptions options;
  std::vector<MapRules> map_rules;                          // [maps]
  std::vector<MapView> map_views;                           // [maps] of map_rules
  std::vector<int32_t> slot_begin, box_begin, light_begin;  // [worlds + 1]
  std::vector<int32_t> world_of_slot, agent_of_slot;        // [slots]
  std::vector<uint32_t> global_world;                       // [worlds]

  // State. box_cells and cell_centers are made anew by every step and are not saved.
  AgentState agents;
  std::vector<AgentBox> boxes, boxes_before;  // the scene's agents
  std::vector<LightPlan> light_plans;
  std::vector<LightState> lights;
  std::vector<int32_t> episode_step, episode_index;  // [worlds]
  std::vector<uint8_t> episode_over;                 // [worlds] the next step resets
  std::vector<int32_t> spawned;                      // [worlds] in the current episode
  std::vector<SimulatorTotals> world_totals;         // [worlds]

  std::vector<CellLists> box_cells;      // [worlds]
  std::vector<Vec2> cell_centers;        // as boxes, in the order of each world's box_cells
  std::vector<GeometryHandle> geometry;  // [worlds]
  SceneBatch scene;

  /// Calls visit(array of a, array of b) for every array of the state but the agents' fields, in the order in which
  /// they are saved. a and b have members of the same names.
  template <typename A, typename B, typename Visit>
  static void visit_state(A& a, B& b, Visit&& visit) {
    visit(a.boxes, b.boxes);
    visit(a.boxes_before, b.boxes_before);
    visit(a.light_plans, b.light_plans);
    visit(a.lights, b.lights);
    visit(a.episode_step, b.episode_step);
    visit(a.episode_index, b.episode_index);
    visit(a.episode_over, b.episode_over);
    visit(a.spawned, b.spawned);
    visit(a.world_totals, b.world_totals);
  }

 private:
  struct SavedHeader {
    std::array<char, 8> magic{'P', 'I', 'C', 'S', 'T', 'A', 'T', 'E'};
    uint32_t version = 3;
    uint32_t byte_order = 0x01020304;
    uint64_t num_fingerprints = 0;  // that follow: what saver and restorer must have in common
  };
  /// Bytes of the state without its header, and the state to and from so many.
  size_t saved_bytes() const;
  void copy_to(uint8_t* bytes_out) const;
  void assign_from(const uint8_t* bytes);
};

/// What an Error says of a command that a step rejected, see rejected_command().
std::string rejection_text(int64_t rejected);

/// What an executor on the host writes for its users, besides the state.
struct HostResults {
  HostResults(size_t num_slots, const SimulatorConfig& config);
  ObservationView observation_view();
  StepArrays step_arrays() { return {reward.data(), terminated.data(), truncated.data(), valid.data()}; }

  std::vector<float> reward;  // [slots], as the following
  std::vector<uint8_t> terminated, truncated, valid;
  std::vector<View> views;

 private:
#define X(name, type, per_slot, part, comment) std::vector<type> name##_;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

}  // namespace pictura
