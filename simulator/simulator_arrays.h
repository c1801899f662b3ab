// Arrays of a simulator's worlds.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/slot_table.h"
#include "pictura/simulator/totals.h"

namespace pictura {

/// Results of the last step(), besides state and observations.
struct StepResult {
  Span<const float> reward;        // [slots]
  Span<const uint8_t> terminated;  // [slots] 1: an infraction ended the agent's episode
  Span<const uint8_t> truncated;   // [slots] 1: the episode or life ended otherwise, so bootstrap
  Span<const uint8_t> valid;       // [slots] 1: learn from this step (the agent is active, unimpaired and no opponent)
  Span<const SpawnFailure> refusal;  // [slots] why the agent is absent from this episode, or `none`
  Span<const StepSums> sums;         // [slots] reward terms and distance; 0 if not valid
};

/// Arrays after the last reset() or step(), in the memory of `device`. For their validity, see Simulator.
struct SimulatorArrays {
  Device device;
  SlotTable slots;
  ObservationView observations;
  SceneBatch scene;            // boxes by world: controlled agents, then parked cars
  Span<const uint8_t> driver;  // [slots] see driver_of() in rules/impairment.h
  Span<const View> views;      // [slots] see Simulator::views()
  AgentStateView state{};
  // [worlds] Steps taken in the episode; index of the episode; 1 if the next step begins the next episode.
  Span<const int32_t> episode_step, episode_index;
  Span<const uint8_t> episode_over;
  Span<const SimulatorTotals> world_totals;  // [worlds]
  Span<const uint64_t> seed;                 // [worlds]
  StepResult results;
};

}  // namespace pictura
