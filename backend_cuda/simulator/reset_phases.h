// Phases that begin episodes. The first episode of a seed begins immediately. Later episodes are prepared while the
// previous episode continues.
#pragma once

#include "pictura/backend_cuda/simulator/observation_phases.h"
#include "pictura/simulator/rules/spawn.h"

namespace pictura::cuda {

/// Boxes of a world that choose a place at the same time.
constexpr int kTurn = 128;

/// Memory shared by a team's threads.
struct TeamMemory {
  int32_t lowest_changed;
};

/// Chooses a try (a candidate place) for each of the `count` boxes from first_box on, and adds the placed boxes to
/// scratch.standing (the standing boxes). A box takes its first try that the map permits and that is clear of standing
/// boxes and of boxes with lower numbers.
/// kTurn boxes choose at the same time. In each round, every box that is not fixed chooses again, given the last
/// choices of the others, until no choice changes. Every round fixes at least the lowest changed box. The result equals
/// that of placing the boxes one after the other.
/// Callbacks: box_of_try(i, try), permits(group, i, try, box).
template <typename Team, typename BoxOfTry, typename Permits>
PICTURA_HD void choose_tries(const Team& team, const WorldView& world, const WorldScratch& scratch, int first_box,
                             int count, const BoxOfTry& box_of_try, const Permits& permits) {
  static_assert(kSpawnTries <= 32);
  AgentBox* boxes = world.boxes + first_box;
  AgentBox* try_boxes = scratch.try_boxes + first_box * kSpawnTries;
  uint32_t* free_tries = scratch.free_tries + first_box;
  int32_t* known_tries = scratch.known_tries + first_box;
  int32_t* chosen_try = scratch.chosen_try + first_box;
  int32_t* next_try = scratch.next_try + first_box;
  int32_t& lowest_changed = team.memory().lowest_changed;
  // At first, two tries of each box are evaluated together, or more if there are few boxes.
  const int first_tries = clamp(kTurn / max_of(count, 1), 2, kSpawnTries);
  team.for_each(count, [&](int i) {
    boxes[i].drawn = 0;
    free_tries[i] = 0;
    known_tries[i] = 0;
    chosen_try[i] = -1;
  });
  // Returns whether a try is permitted and clear of the boxes that stood before this turn.
  const auto evaluate_try = [&](const auto& group, int i, int t) {
    const AgentBox box = box_of_try(i, t);
    const bool is_free = is_clear(world, box, scratch.standing, group) && permits(group, i, t, box);
    if (is_free && group.rank() == 0) try_boxes[i * kSpawnTries + t] = box;
    return is_free;
  };
  // Evaluates a box's tries until one is clear of standing boxes and of this turn's choices.
  const auto choose = [&](const auto& group, int turn_begin, int i) {
    uint32_t free = free_tries[i];
    int known = known_tries[i], chosen = -1;
    for (int t = 0; t < kSpawnTries && chosen < 0; ++t) {
      if (t == known) {
        ++known;
        if (evaluate_try(group, i, t)) free |= 1u << t;
        group.sync();
      }
      const AgentBox& box = try_boxes[i * kSpawnTries + t];
      if ((free >> t & 1u) && is_clear(world, box, first_box + turn_begin, first_box + i, group)) chosen = t;
    }
    group.sync();
    if (group.rank() > 0) return;
    free_tries[i] = free;
    known_tries[i] = known;
    next_try[i] = chosen;
    if (chosen != chosen_try[i]) team.lower(&lowest_changed, i);
  };
  const auto add_to_standing = [&](int begin, int end) {
    team.for_each(end - begin, [&](int k) {
      const int i = begin + k;
      if (!boxes[i].drawn) return;
      add_box(scratch.standing, first_box + i, boxes[i].center_m.xy(),
              [&team](int32_t* value, int32_t other) { return team.exchange(value, other); });
    });
  };
  int turn_begin = -kTurn;
  for (int settled = 0; settled < count;) {
    if (settled >= turn_begin + kTurn) {
      add_to_standing(max_of(turn_begin, 0), settled);
      turn_begin = settled;
      const int num_tries = min_of(kTurn, count - turn_begin) * first_tries;
      team.template for_each_by_groups<kThreadsPerAgent>(num_tries, [&](const auto& group, int k) {
        const int i = turn_begin + k / first_tries, t = k % first_tries;
        const bool is_free = evaluate_try(group, i, t);
        if (group.rank() == 0 && is_free) team.set_bits(&free_tries[i], 1u << t);
        if (group.rank() == 0 && t == 0) known_tries[i] = first_tries;
      });
    }
    const int unsettled = min_of(turn_begin + kTurn, count) - settled;
    team.for_each(1, [&](int) { lowest_changed = settled + unsettled; });
    team.template for_each_by_groups<kThreadsPerAgent>(
        unsettled, [&](const auto& group, int k) { choose(group, turn_begin, settled + k); });
    const int changed = lowest_changed;
    team.for_each(unsettled, [&](int k) {
      const int i = settled + k;
      if (next_try[i] == chosen_try[i]) return;
      chosen_try[i] = next_try[i];
      if (chosen_try[i] >= 0) boxes[i] = try_boxes[i * kSpawnTries + chosen_try[i]];
      boxes[i].drawn = chosen_try[i] >= 0;
    });
    settled = min_of(changed + 1, settled + unsettled);
  }
  add_to_standing(max_of(turn_begin, 0), count);
}

/// spawned_out: number of agents that found a place. This function and the phases that call it are always inlined.
/// Otherwise kernels would keep `world` in local memory, which for a block of this size exceeds the L1 cache.
template <typename Team>
[[gnu::always_inline]] PICTURA_HD inline void begin_episode(const Team& team, const WorldView& world,
                                                            const WorldScratch& scratch, int32_t* spawned_out) {
  const int num_parked = world.num_boxes - world.num_agents;
  team.for_each(static_cast<int>(world.map.stop_lines.size()), [&](int light) { begin_light(world, light); });
  team.for_each(world.num_agents, [&](int agent) { draw_agent(world, agent); });
  team.for_each(scratch.standing.num_cells(), [&](int cell) { scratch.standing.first[cell] = -1; });
  const auto parked_at = [&](int car, int i) {
    return parked_box(world, car, world.map.parking_spots.empty() ? ParkingSpot{} : parking_spot(world, car, i));
  };
  const bool replays = has_replayed_tracks(world.map);
  choose_tries(team, world, scratch, world.num_agents, replays ? 0 : num_parked, parked_at,
               [&](const auto& group, int car, int i, const AgentBox& box) {
                 return !world.map.parking_spots.empty() &&
                        may_park(world.map, box, parking_spot(world, car, i), group);
               });
  team.template for_each_by_groups<kThreadsPerAgent>(num_parked, [&](const auto& group, int car) {
    if (replays) return replay_track(world, car, 0, group);
    if (group.rank() == 0) put_parked_car(world, car, scratch.chosen_try[world.num_agents + car]);
  });
  const auto agent_at = [&](int agent, int i) {
    return has_places(world, agent) ? spawn_box(world, agent, i) : AgentBox{};
  };
  choose_tries(team, world, scratch, 0, world.num_agents, agent_at,
               [&](const auto& group, int agent, int, const AgentBox& box) {
                 return has_places(world, agent) && may_spawn(world.map, box, group);
               });
  team.for_each(1, [&](int) { *spawned_out = 0; });
  team.template for_each_by_groups<kThreadsPerAgent>(world.num_agents, [&](const auto& group, int agent) {
    place_agent(world, agent, scratch.chosen_try[agent], group);
    if (group.rank() == 0 && joins_episode(world, agent, scratch.chosen_try[agent])) team.add(spawned_out, 1);
  });
}

/// Begins episode 0 of `seed` in the worlds of the mask [worlds]; null: all.
struct BeginFirstEpisode {
  PhaseArrays arrays;
  const uint8_t* mask;
  uint64_t seed;
  PICTURA_HD bool has_work(int w) const { return !mask || mask[w]; }
  template <typename Team>
  [[gnu::always_inline]] PICTURA_HD void operator()(const Team& team, int w) const {
    team.for_each(1, [&](int) {
      arrays.seed[w] = arrays.worlds[w].seed = arrays.next_worlds[w].seed = seed;
      arrays.episode_over[w] = 0;
      arrays.episode_step[w] = arrays.episode_index[w] = 0;
      arrays.worlds[w].episode = 0;
      arrays.next_worlds[w].episode = 1;
      arrays.began[w] = 1;
    });
    const WorldView world = arrays.world(w);
    team.for_each(world.num_agents, [&](int agent) { clear_result(arrays.results, world.first_slot + agent); });
    begin_episode(team, world, arrays.scratch[w], &arrays.spawned[w]);
  }
};

struct PlaceCenters {
  PhaseArrays arrays;
  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int w) const {
    const WorldView world = arrays.world(w);
    for (int i = group.rank(); i < world.num_boxes; i += group.size()) {
      world.cell_centers[i] = center_of(world.boxes[i]);
    }
  }
};

/// Sorts the boxes of crowds (see is_crowd()) into cells by counting, in arbitrary order within a cell. ends_step: the
/// second sort of a step, which skips worlds that began no episode, unless some map has roads that end.
struct SortBoxes {
  PhaseArrays arrays;
  bool ends_step = false;
  PICTURA_HD bool has_work(int w) const {
    return arrays.scratch[w].cell_begin && (!ends_step || arrays.began[w] || arrays.has_lives);
  }
  template <typename Team>
  PICTURA_HD void operator()(const Team& team, int w) const {
    int32_t* const begin = arrays.scratch[w].cell_begin;
    int32_t* const items = arrays.scratch[w].cell_items;
    const WorldView world = arrays.world(w);
    const GridView& cells = world.box_cells;
    const int num_cells = cells.num_x * cells.num_y;
    const auto for_each_drawn = [&](const auto& body) {
      team.for_each(world.num_boxes, [&](int i) {
        if (!world.boxes[i].drawn) return;
        const Vec2 center = world.boxes[i].center_m.xy();
        body(i, center, begin + cells.cell_y(center.y) * cells.num_x + cells.cell_x(center.x));
      });
    };
    team.for_each(num_cells, [&](int cell) { begin[cell] = 0; });
    for_each_drawn([&](int, Vec2, int32_t* count) { team.add(count, 1); });
    // Converts each cell's count to the end of its range.
    team.template for_each_by_groups<kWarp>(1, [&](const auto& group, int) {
      const int share = (num_cells + group.size() - 1) / group.size();
      const int first = min_of(group.rank() * share, num_cells), end = min_of(first + share, num_cells);
      int32_t own = 0, before = 0, all = 0;
      for (int cell = first; cell < end; ++cell) own += begin[cell];
      for (int lane = 0; lane < group.size(); ++lane) {
        const int32_t other = group.from(lane, own);
        before += lane < group.rank() ? other : 0;
        all += other;
      }
      for (int cell = first; cell < end; ++cell) begin[cell] = before += begin[cell];
      if (group.rank() == 0) begin[num_cells] = all;
    });
    for_each_drawn([&](int i, Vec2 center, int32_t* cell_end) {
      const int32_t at = team.add(cell_end, -1) - 1;
      items[at] = i;
      world.cell_centers[at] = center;
    });
  }
};

template <typename Launch>
void launch_sort_boxes(const Launch& launch, const PhaseArrays& arrays, bool ends_step = false) {
  if (arrays.has_crowds) launch.teams(arrays.num_worlds, SortBoxes{arrays, ends_step});
}

/// Prepares a world's next episode as soon as the memory for it is free. The episode's start does not depend on earlier
/// steps.
struct PrepareEpisode {
  PhaseArrays arrays;
  PICTURA_HD bool has_work(int w) const { return arrays.prepares[w]; }
  template <typename Team>
  [[gnu::always_inline]] PICTURA_HD void operator()(const Team& team, int w) const {
    begin_episode(team, arrays.next_world(w), arrays.scratch[w], &arrays.next_spawned[w]);
  }
};

template <typename Launch>
void launch_reset(const Launch& launch, const PhaseArrays& arrays, const uint8_t* mask, uint64_t seed) {
  launch.teams(arrays.num_worlds, BeginFirstEpisode{arrays, mask, seed});
  launch.template groups<kWarp>(arrays.num_worlds, PlaceCenters{arrays});
  launch_sort_boxes(launch, arrays);
  launch_write_observations(launch, arrays);
}

/// Sets the worlds' episode and seed from a restored state.
struct TakeEpisode {
  PhaseArrays arrays;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int w) const {
    arrays.worlds[w].seed = arrays.next_worlds[w].seed = arrays.seed[w];
    arrays.worlds[w].episode = static_cast<uint32_t>(arrays.episode_index[w]);
    arrays.next_worlds[w].episode = arrays.worlds[w].episode + 1;
  }
};

template <typename Launch>
void launch_publish_restored(const Launch& launch, const PhaseArrays& arrays) {
  const auto num_slots = static_cast<size_t>(arrays.num_slots);
  launch.fill(arrays.results.reward, num_slots * sizeof(float), 0);
  launch.fill(arrays.results.sums, num_slots * sizeof(StepSums), 0);
  for (uint8_t* flags : {arrays.results.terminated, arrays.results.truncated, arrays.results.valid}) {
    launch.fill(flags, num_slots, 0);
  }
  launch.threads(arrays.num_worlds, TakeEpisode{arrays});
  launch.fill(arrays.began, static_cast<size_t>(arrays.num_worlds), 0);
  launch.fill(arrays.prepares, static_cast<size_t>(arrays.num_worlds), 1);
  launch.teams(arrays.num_worlds, PrepareEpisode{arrays});
  launch.template groups<kWarp>(arrays.num_worlds, PlaceCenters{arrays});
  launch_sort_boxes(launch, arrays);
  launch_write_observations(launch, arrays);
}

}  // namespace pictura::cuda
