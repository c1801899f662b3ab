// The state of a simulator on the host: everything that is saved. An executor on the host steps it; one on a device
// mirrors it there. Saving, restoring, hashing and counting are the same for all.
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
  /// Gives everything the setup's size and its first value.
  void resize(const SimulatorSetup& setup);
  /// Allocates, so that a resize within it moves no array; boxes as the setup's configuration has them.
  void reserve(const SimulatorCapacity& capacity, const SimulatorConfig& config);

  SpawnReport spawn_report(const SimulatorSetup& setup) const;
  SimulatorTotals totals() const;
  /// Over every field of the agents, the light states and the parked cars, in the documented order.
  uint64_t hash(const SimulatorSetup& setup) const;

  /// Copies the state of `count` worlds, which must be as large in both, from world `from_world` of another simulator.
  void copy_worlds(const SimulatorSetup& setup, int world, const SimulatorState& from, const SimulatorSetup& from_setup,
                   int from_world, int count);

  std::vector<uint8_t> save(const SimulatorSetup& setup) const;
  /// Throws Error, and leaves everything as it was, when the bytes are of another simulator, naming what differs, or
  /// when a field holds what no simulator saved.
  void restore(const SimulatorSetup& setup, Span<const uint8_t> bytes);

  AgentState agents;
  std::vector<AgentBox> boxes, boxes_before;  // the scene's agents
  std::vector<LightPlan> light_plans;
  std::vector<LightState> lights;
  std::vector<uint64_t> seed;                        // [worlds] of its random numbers
  std::vector<int32_t> episode_step, episode_index;  // [worlds]
  std::vector<uint8_t> episode_over;                 // [worlds] the next step resets
  std::vector<int32_t> spawned;                      // [worlds] in the current episode
  std::vector<SimulatorTotals> world_totals;         // [worlds]

  /// Calls visit(array of a, array of b) for every array of the state but the agents' fields, in the order in which
  /// they are saved. a and b have members of the same names.
  template <typename A, typename B, typename Visit>
  static void visit_arrays(A& a, B& b, Visit&& visit) {
    visit_arrays_by_kind(a, b, visit, visit, visit);
  }
  /// The same with a visitor each for what there is of each box, of each light and of each world.
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
  /// Bytes of the state without its header, and the state to and from so many; with the lives of agents or without.
  size_t saved_bytes(bool with_lives) const;
  void copy_to(uint8_t* bytes_out, bool with_lives) const;
  void assign_from(const uint8_t* bytes, bool with_lives);
};

/// What an Error says of a command that a step rejected, see rejected_command().
std::string rejection_text(int64_t rejected);
/// What an Error says of an edit in which find_edit_fault() found this.
std::string edit_fault_text(int64_t fault, int num_slots);
/// What an Error says of a query in which find_query_fault() found this.
std::string query_fault_text(int64_t fault, int num_slots);

}  // namespace pictura
