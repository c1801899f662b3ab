// State of a simulator in host memory: all data that are saved. The executor `cuda` has a copy on the device.
#pragma once

#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/agent_state.h"
#include "pictura/simulator/rules/signal.h"
#include "pictura/simulator/simulator_setup.h"

namespace pictura {

struct SimulatorState {
  SimulatorState() = default;
  explicit SimulatorState(const SimulatorSetup& setup) { resize(setup); }
  /// Sets initial values.
  void resize(const SimulatorSetup& setup);
  /// Reserves memory, so that a resize within the capacity moves no array.
  void reserve(const SimulatorCapacity& capacity, const SimulatorConfig& config);

  SpawnReport spawn_report(const SimulatorSetup& setup) const;
  SimulatorTotals totals() const;
  /// Hash of the agents' fields, light states and parked cars.
  uint64_t hash(const SimulatorSetup& setup) const;

  /// Copies worlds [from_world, from_world + count) of `from` to worlds [world, world + count). Each pair must have
  /// equal sizes.
  void copy_worlds(const SimulatorSetup& setup, int world, const SimulatorState& from, const SimulatorSetup& from_setup,
                   int from_world, int count);

  std::vector<uint8_t> save(const SimulatorSetup& setup) const;
  /// Throws Error, leaving everything unchanged, for bytes of a different simulator (the message names the difference)
  /// or with an invalid field value.
  void restore(const SimulatorSetup& setup, Span<const uint8_t> bytes);

  AgentState agents;
  std::vector<AgentBox> boxes, boxes_before;  // the scene's agents
  std::vector<LightPlan> light_plans;
  std::vector<LightState> lights;
  std::vector<uint64_t> seed;                        // [worlds]
  std::vector<int32_t> episode_step, episode_index;  // [worlds]
  std::vector<uint8_t> episode_over;                 // [worlds] 1: the next step resets the world
  std::vector<int32_t> spawned;                      // [worlds] agents in the current episode
  std::vector<SimulatorTotals> world_totals;         // [worlds]

  /// Calls visit(a.array, b.array) for every array except the agents' fields, in the order of saving. Types A and B
  /// must have members with the same names.
  template <typename A, typename B, typename Visit>
  static void visit_arrays(A& a, B& b, Visit&& visit) {
    visit_arrays_by_kind(a, b, visit, visit, visit);
  }
  /// Variant with visitors for arrays indexed by box, by light and by world.
  template <typename A, typename B, typename OfBoxes, typename OfLights, typename OfWorlds>
  static void visit_arrays_by_kind(A& a, B& b, OfBoxes&& of_boxes, OfLights&& of_lights, OfWorlds&& of_worlds) {
    of_boxes(a.boxes, b.boxes);
    of_boxes(a.boxes_before, b.boxes_before);
    of_lights(a.light_plans, b.light_plans);
    of_lights(a.lights, b.lights);
    of_worlds(a.seed, b.seed);
    of_worlds(a.episode_step, b.episode_step);
    of_worlds(a.episode_index, b.episode_index);
    of_worlds(a.episode_over, b.episode_over);
    of_worlds(a.spawned, b.spawned);
    of_worlds(a.world_totals, b.world_totals);
  }

 private:
  size_t saved_bytes(bool with_lives) const;
  void copy_to(uint8_t* bytes_out, bool with_lives) const;
  void assign_from(const uint8_t* bytes, bool with_lives);
};

/// Error message for a result of rejected_command().
std::string rejection_text(int64_t rejected);
/// Error message for a result of find_edit_fault().
std::string edit_fault_text(int64_t fault, int num_slots);
/// Error message for a result of find_query_fault().
std::string query_fault_text(int64_t fault, int num_slots);

}  // namespace pictura
