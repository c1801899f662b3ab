// Arrays of a simulator: state, observations and results of all its worlds.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/slot_table.h"
#include "pictura/simulator/totals.h"

namespace pictura {

/// Results of the last step(), besides state and observations.
struct StepResult {
  Span<const float> reward;          // [slots]
  Span<const uint8_t> terminated;    // [slots] 1: an infraction ended the agent's episode in this step
  Span<const uint8_t> truncated;     // [slots] 1: the episode or life ended in another way, so bootstrap
  Span<const uint8_t> valid;         // [slots] 1: learn from this step: the agent was active at the step's start, and
                                     // is neither impaired nor an opponent
  Span<const SpawnFailure> refusal;  // [slots] reason why the agent is absent from this episode, or `none`
  Span<const StepSums> sums;         // [slots] reward terms and distance of the step; 0 if not valid
};

/// Arrays of all worlds after the last reset() or step(), in the memory of `device`. Addresses and lengths stay valid
/// until set_worlds() or reserve(); see Simulator::generation().
struct SimulatorArrays {
  Device device;
  SlotTable slots;
  ObservationView observations;
  SceneBatch scene;            // boxes by world: controlled agents, then parked cars
  Span<const uint8_t> driver;  // [slots] driver of the agent in this episode, see driver_of() in rules/impairment.h
  Span<const View> views;      // [slots] see Simulator::views()
  AgentStateView state{};
  // [worlds] Number of steps in the current episode; index of the episode; 1 if the episode has ended, so that the next
  // step begins the next episode.
  Span<const int32_t> episode_step, episode_index;
  Span<const uint8_t> episode_over;
  Span<const SimulatorTotals> world_totals;  // [worlds]
  Span<const uint64_t> seed;                 // [worlds] seeds of random numbers
  StepResult results;
};

}  // namespace pictura
