// Arrays of a simulator: its worlds' state, observations and results.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/slot_table.h"
#include "pictura/simulator/totals.h"

namespace pictura {

/// Results of the last step(), besides the state and its observations.
struct StepResult {
  Span<const float> reward;        // [slots]
  Span<const uint8_t> terminated;  // [slots] 1: an infraction ended the agent's episode in this step
  Span<const uint8_t> truncated;   // [slots] 1: another end of the episode, or of a life on a road that ends; bootstrap
  Span<const uint8_t> valid;  // [slots] 1: the agent was active when the step began, and not impaired: learn from it
  Span<const SpawnFailure> refusal;  // [slots] reason why the agent is absent from this episode, or `none`
  Span<const StepSums> sums;         // [slots] reward terms and the agent's distance; 0 if not valid
};

/// Arrays of all worlds after the last reset() or step(), in the memory of `device`. An executor sets them once for its
/// worlds: addresses and lengths stay until set_worlds() or reserve(), see Simulator::generation().
struct SimulatorArrays {
  Device device;
  SlotTable slots;
  ObservationView observations;
  SceneBatch scene;            // controlled agents in slot order, each world's parked cars after its controlled agents
  Span<const uint8_t> driver;  // [slots] driver of the agent in this episode, see driver_of() in rules/impairment.h
  Span<const View> views;      // [slots] poses of the agents' cameras, see Simulator::views()
  AgentStateView state{};
  // [worlds] number of steps in the current episode, index of that episode, and 1 if the episode has ended, so that the
  // next step begins another episode.
  Span<const int32_t> episode_step, episode_index;
  Span<const uint8_t> episode_over;
  Span<const SimulatorTotals> world_totals;  // [worlds]
  Span<const uint64_t> seed;                 // [worlds] seeds of random numbers
  StepResult results;
};

}  // namespace pictura
