// Phases of a step.
#pragma once

#include "pictura/backend_cuda/simulator/reset_phases.h"
#include "pictura/simulator/rules/enter.h"

namespace pictura::cuda {

/// Finds the lowest slot with a command out of range. CommandType: int32_t (an action) or Command.
template <typename CommandType>
struct CheckCommands {
  PhaseArrays arrays;
  const CommandType* commands;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int slot) const {
    const WorldView world = arrays.world(arrays.world_of_slot[slot]);
    if (slot == world.first_slot) arrays.began[world.index] = 0;  // arrays.prepares has a copy of the old value
    if (arrays.episode_over[world.index] || accepts(world, slot - world.first_slot, commands[slot])) return;
    atomics.lower(arrays.rejected_slot, slot);
  }
};

/// Moves an agent, or starts it in the prepared episode.
template <typename CommandType>
struct Advance {
  PhaseArrays arrays;
  const CommandType* commands;
  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int slot) const {
    if (arrays.has_rejected_command()) return;
    const int w = arrays.world_of_slot[slot];
    const WorldView world = arrays.world(w);
    const int agent = slot - world.first_slot;
    if (!arrays.episode_over[w]) {
      const CommandType& command = commands[slot];
      const bool drives = is_counted(world, agent, command);
      if (group.rank() == 0) arrays.results.valid[slot] = drives;
      advance(world, agent, command, arrays.episode_step[w] + 1, group);
    } else if (group.rank() == 0) {
      const WorldView next = arrays.next_world(w);
      clear_result(arrays.results, slot);
      copy_fields(next.agents, slot, world.agents, slot);
      world.boxes[agent] = world.boxes_before[agent] = next.boxes[agent];
    }
    if (group.rank() == 0) world.cell_centers[agent] = center_of(world.boxes[agent]);
  }
};

/// Moves the box of a replayed track. `index` counts the boxes that belong to no agent, world by world.
struct ReplayTracks {
  PhaseArrays arrays;
  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int index) const {
    const int w = index / arrays.parked_per_world, i = index % arrays.parked_per_world;
    if (arrays.has_rejected_command() || arrays.episode_over[w]) return;
    const WorldView world = arrays.world(w);
    if (!has_replayed_tracks(world.map)) return;
    replay_track(world, i, arrays.episode_step[w] + 1, group);
    const int box = world.num_agents + i;
    if (group.rank() == 0) world.cell_centers[box] = center_of(world.boxes[box]);
  }
};

struct ApplyRewardAndHalt {
  PhaseArrays arrays;
  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int slot) const {
    const int w = arrays.world_of_slot[slot];
    if (arrays.has_rejected_command() || arrays.episode_over[w]) return;
    const WorldView world = arrays.world(w);
    const int agent = slot - world.first_slot;
    find_collisions(world, agent, group);
    if (group.rank() > 0) return;
    apply_reward_and_halt(world, agent, arrays.episode_step[w] + 1, arrays.results);
  }
};

/// Counts a world's step, advances its lights, and determines whether its episode is over. If the episode was already
/// over, the phase instead completes the move into the next episode.
template <typename CommandType>
struct FinishStep {
  PhaseArrays arrays;
  const CommandType* commands;
  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int w) const {
    if (arrays.has_rejected_command()) return reject(group, w);
    const bool begins = arrays.episode_over[w] != 0;
    SimulatorTotals totals;
    bool ends = false;
    if (begins) {
      take_next(group, w);
    } else {
      ends = count(group, w, &totals);
    }
    group.sync();
    if (group.rank() > 0) return;
    totals.slot_steps = arrays.worlds[w].num_agents;
    totals.episodes = begins;
    arrays.world_totals[w].add(totals);
    arrays.episode_over[w] = ends;
    ++arrays.episode_step[w];
    if (!begins) return;
    arrays.episode_step[w] = 0;
    arrays.spawned[w] = arrays.next_spawned[w];
    arrays.worlds[w].episode = static_cast<uint32_t>(++arrays.episode_index[w]);
    arrays.next_worlds[w].episode = arrays.worlds[w].episode + 1;
    arrays.began[w] = 1;
  }

 private:
  template <typename ThreadGroup>
  PICTURA_HD void reject(const ThreadGroup& group, int w) const {
    if (w > 0 || group.rank() > 0 || *arrays.rejected_command != kNoRejection) return;
    *arrays.rejected_command = rejected_command(*arrays.rejected_slot, commands[*arrays.rejected_slot]);
  }

  /// Copies the lights, and the boxes that belong to no agent, from the prepared episode.
  template <typename ThreadGroup>
  PICTURA_HD void take_next(const ThreadGroup& group, int w) const {
    const WorldView world = arrays.world(w), next = arrays.next_world(w);
    for (int i = world.num_agents + group.rank(); i < world.num_boxes; i += group.size()) {
      world.boxes[i] = world.boxes_before[i] = next.boxes[i];
      world.cell_centers[i] = center_of(next.boxes[i]);
    }
    for (int i = group.rank(); i < static_cast<int>(world.map.stop_lines.size()); i += group.size()) {
      world.light_plans[i] = next.light_plans[i];
      world.lights[i] = next.lights[i];
    }
  }

  /// Counts a step, and returns whether the episode is over.
  template <typename ThreadGroup>
  PICTURA_HD bool count(const ThreadGroup& group, int w, SimulatorTotals* totals_out) const {
    const WorldView world = arrays.world(w);
    const int steps = arrays.episode_step[w] + 1;
    constexpr int kParts = kTotalsBins / ThreadGroup::kSize;  // bins per thread
    SimulatorTotals parts[kParts];
    const auto for_each_agent = [&](const auto& body) {
      for (int part = 0; part < kParts; ++part) {
        for (int agent = part * ThreadGroup::kSize + group.rank(); agent < world.num_agents; agent += kTotalsBins) {
          body(agent, &parts[part]);
        }
      }
    };
    int active = 0;
    for_each_agent([&](int agent, SimulatorTotals* part) {
      count_agent(world, agent, arrays.results, part);
      active += keeps_episode(world, agent);
    });
    const bool ends = episode_ends(world, steps, arrays.spawned[w], group.sum(active));
    for_each_agent([&](int agent, SimulatorTotals* part) { finish_agent(world, agent, ends, arrays.results, part); });
    add_up(group, parts, totals_out);
    for (int i = group.rank(); i < static_cast<int>(world.map.stop_lines.size()); i += group.size()) {
      world.lights[i] = light_state(world.map, i, world.light_plans[i], steps);
    }
    return ends;
  }

  /// Adds floating-point numbers in the order of the totals' bins (simulator/totals.h).
  template <typename ThreadGroup, int kParts>
  PICTURA_HD static void add_up(const ThreadGroup& group, SimulatorTotals (&parts)[kParts], SimulatorTotals* sum_out) {
    const auto skip = [](auto&, auto) {};
    for (SimulatorTotals& part : parts) {
      const auto add_count = [&group](int64_t& sum, int64_t count) {
        sum += group.sum(static_cast<int>(count));  // at most a world's agents
      };
      SimulatorTotals::visit(*sum_out, part, add_count, skip);
    }
    for (int lane = 0; lane < kTotalsBins; ++lane) {
      const auto add_sum = [&group, lane](double& sum, double value) {
        sum += group.from(lane % ThreadGroup::kSize, value);
      };
      SimulatorTotals::visit(*sum_out, parts[lane / ThreadGroup::kSize], skip, add_sum);
    }
  }
};

/// On roads that end, lets waiting agents enter after a step that did not end the episode.
struct EnterWaiting {
  PhaseArrays arrays;
  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int w) const {
    const int steps = arrays.episode_step[w];
    if (arrays.has_rejected_command() || arrays.episode_over[w] || steps == 0) return;
    const WorldView world = arrays.world(w);
    enter_waiting(world, steps, group, [&group, &world](int agent) {
      if (group.rank() == 0) world.cell_centers[agent] = center_of(world.boxes[agent]);
    });
  }
};

template <typename Launch, typename CommandType>
void launch_step(const Launch& launch, const PhaseArrays& arrays, const CommandType* commands) {
  launch.copy(arrays.prepares, arrays.began, static_cast<size_t>(arrays.num_worlds));
  launch.fork_join([&](const Launch& side) { side.teams(arrays.num_worlds, PrepareEpisode{arrays}); },
                   [&] {
                     launch.threads(arrays.num_slots, CheckCommands<CommandType>{arrays, commands});
                     launch.template groups<kThreadsPerAgent>(arrays.num_slots, Advance<CommandType>{arrays, commands});
                     if (arrays.has_replayed_tracks && arrays.parked_per_world > 0) {
                       launch.template groups<kThreadsPerAgent>(arrays.num_worlds * arrays.parked_per_world,
                                                                ReplayTracks{arrays});
                     }
                     launch_sort_boxes(launch, arrays);
                     launch.template groups<kThreadsPerAgent>(arrays.num_slots, ApplyRewardAndHalt{arrays});
                     launch.template groups<kWarp>(arrays.num_worlds, FinishStep<CommandType>{arrays, commands});
                     if (arrays.has_lives) launch.template groups<kWarp>(arrays.num_worlds, EnterWaiting{arrays});
                     launch_sort_boxes(launch, arrays, /*ends_step=*/true);
                     launch_write_observations(launch, arrays);
                   });
}

}  // namespace pictura::cuda
