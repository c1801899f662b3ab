// What a simulator shows: where its worlds' state, observations and results lie.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/slot_table.h"
#include "pictura/simulator/totals.h"

namespace pictura {

/// What the last step() gave, besides the state and what is observed of it.
struct StepResult {
  Span<const float> reward;        // [slots]
  Span<const uint8_t> terminated;  // [slots] 1: an infraction ended the agent's episode in this step
  Span<const uint8_t> truncated;   // [slots] 1: it ended for another reason, or a life on a road that ends; bootstrap
  Span<const uint8_t> valid;  // [slots] 1: the agent was active when the step began, and not impaired: learn from it
  Span<const SpawnFailure> refusal;  // [slots] why the agent is absent from this episode, or `none`
  Span<const StepSums> sums;  // [slots] the reward's terms, and the distance that the agent drove; 0 if not valid
};

/// The arrays of all worlds after the last reset() or step(), in the memory of `device`. An executor fills this once
/// for its worlds: addresses and lengths last until set_worlds() or reserve(), see Simulator::generation().
struct SimulatorArrays {
  Device device;
  SlotTable slots;
  ObservationView observations;
  SceneBatch scene;            // controlled agents in slot order, each world's parked cars after its controlled agents
  Span<const uint8_t> driver;  // [slots] of agents in this episode, see driver_of() in rules/impairment.h
  Span<const View> views;      // [slots] where the agents' cameras stand, see Simulator::views()
  AgentStateView state{};
  // [worlds] steps done in the current episode, the number of that episode, and 1 where it has ended, so that the next
  // step begins the next one.
  Span<const int32_t> episode_step, episode_index;
  Span<const uint8_t> episode_over;
  Span<const SimulatorTotals> world_totals;  // [worlds]
  Span<const uint64_t> seed;                 // [worlds] of its random numbers
  StepResult results;
};

}  // namespace pictura
