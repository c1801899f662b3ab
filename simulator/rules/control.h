// Controllers that compute a command from a slot's index or a table, for all executors.
#pragma once

#include "pictura/common/rng.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/slot_table.h"
#include "pictura/simulator/totals.h"

namespace pictura {

PICTURA_HD inline int32_t random_action(uint64_t seed, uint32_t global_world, int agent, uint32_t step) {
  RandomStream random({.seed = seed,
                       .world = global_world,
                       .agent = static_cast<uint32_t>(agent),
                       .step = step,
                       .purpose = Purpose::action});
  return random.below(kNumActions);
}

/// Number of steps of a world, including steps that only reset it.
PICTURA_HD inline uint32_t steps_of(const SimulatorTotals& world_totals, int32_t num_agents) {
  return static_cast<uint32_t>(world_totals.slot_steps / num_agents);
}

/// Random actions, which depend only on seed, world, agent and the world's number of steps. A restored simulator
/// continues with the same actions.
struct RandomCommands {
  uint64_t seed;
  SlotTable slots;
  Span<const SimulatorTotals> world_totals;

  PICTURA_HD Command operator()(size_t slot) const {
    const auto world = static_cast<size_t>(slots.world_of_slot[slot]);
    const int32_t num_agents = slots.slot_begin[world + 1] - slots.slot_begin[world];
    Command command;
    command.action = random_action(seed, slots.global_world[world], slots.agent_of_slot[slot],
                                   steps_of(world_totals[world], num_agents));
    return command;
  }
};

struct IdleCommands {
  PICTURA_HD Command operator()(size_t) const { return {}; }
};

struct RecordedCommands {
  PICTURA_HD Command operator()(size_t) const {
    Command command;
    command.kind = CommandKind::recorded;
    return command;
  }
};

/// A world's actions [agents, num_steps], from index `first` of TabledCommands::actions on.
struct ActionTable {
  int64_t first = 0;
  int32_t num_steps = 0;
};

/// Actions for the first num_steps steps of each episode, then actions without jerk.
struct TabledCommands {
  SlotTable slots;
  Span<const int32_t> episode_step;  // [worlds]
  Span<const ActionTable> tables;    // [worlds]
  Span<const int32_t> actions;

  PICTURA_HD Command operator()(size_t slot) const {
    const auto world = static_cast<size_t>(slots.world_of_slot[slot]);
    const ActionTable table = tables[world];
    const int32_t step = episode_step[world];
    Command command;
    if (step >= table.num_steps) return command;
    command.action = actions[table.first + int64_t{slots.agent_of_slot[slot]} * table.num_steps + step];
    return command;
  }
};

}  // namespace pictura
