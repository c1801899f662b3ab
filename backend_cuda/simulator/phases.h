// The CUDA executor's step as phases over agents and worlds, which read only what an earlier phase has finished.
// They say what every thread does and not how threads are started, so that a host can run them too, in any order:
//   threads  one thread per item: phase(atomics, item)
//   groups   threads in lockstep (simulator/rules/thread_group.h), a group of them per item: phase(group, item)
//   teams    threads that wait for each other, one team per world: phase(team, world)
// backend_cuda/simulator/kernels.cu starts them on a device; tests/backend_cuda/simulator/shuffled_executor.h on a
// host.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/simulator/rules/edit_state.h"
#include "pictura/simulator/rules/enter.h"
#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/rules/observe_query.h"
#include "pictura/simulator/rules/spawn.h"

namespace pictura::cuda {

/// How many threads share an agent: about as many as there are lane segments, barriers and boxes to test.
constexpr int kThreadsPerAgent = 8, kWarp = 32;
/// How many boxes of a world look for a place at once.
constexpr int kTurn = 128;

/// One world's memory for spawning.
struct WorldScratch {
  AgentBox* try_boxes = nullptr;   // [boxes, kSpawnTries] of the free ones
  uint32_t* free_tries = nullptr;  // [boxes] which of the known tries are free of all that stands, as bits
  int32_t* known_tries = nullptr;  // [boxes] how many have been looked at
  int32_t* chosen_try = nullptr;   // [boxes] -1: none
  int32_t* next_try = nullptr;     // [boxes]
};

/// What no step has as its lowest slot with an action out of range. All its bytes are equal, for memset.
constexpr int32_t kNoSlot = 0x7F7F7F7F;

/// Everything that the phases read and write, in one memory.
struct PhaseArrays {
  WorldView* worlds = nullptr;             // [num_worlds] their box_cells are one cell, which lists all boxes
  WorldView* next_worlds = nullptr;        // [num_worlds] the same worlds, over memory for their next episode
  const WorldScratch* scratch = nullptr;   // [num_worlds]
  const int32_t* world_of_slot = nullptr;  // [num_slots]
  int32_t num_worlds = 0, num_slots = 0;
  // Of all worlds, as in their views; and here, where no store can change them.
  AgentStateView agents{}, next_agents{};
  // State, as in SimulatorState.
  uint64_t* seed = nullptr;
  int32_t* episode_step = nullptr;
  int32_t* episode_index = nullptr;
  uint8_t* episode_over = nullptr;
  int32_t* spawned = nullptr;
  SimulatorTotals* world_totals = nullptr;
  // Results.
  StepArrays results;
  View* views = nullptr;
  ObservationView observations;
  uint8_t entity_sets = 0;
  uint8_t has_lives = 0;  // some map has roads that end
  // Between phases and steps.
  uint8_t* began = nullptr;          // [num_worlds] an episode began in the last step: the one after it is to be made
  uint8_t* prepares = nullptr;       // [num_worlds] it is made in the present step
  int32_t* next_spawned = nullptr;   // [num_worlds] in the next episode
  int32_t* rejected_slot = nullptr;  // the lowest one with a command out of range, or kNoSlot
  int64_t* rejected_command = nullptr;  // the first since the host looked, or kNothingRejected
  int32_t* first_element = nullptr;     // [num_slots] the first element of an edit that names each, or kNoSlot
  int32_t* wrong_element = nullptr;     // the first element of the edit, or query, with a fault, or kNoSlot
  int64_t* wrong_edit = nullptr;        // what the first since the host looked is, or kNothingWrong
  int64_t* wrong_query = nullptr;       // likewise, or kNoQueryFault

  PICTURA_HD WorldView world(int w) const {
    WorldView world = worlds[w];
    world.agents = agents;
    return world;
  }
  PICTURA_HD WorldView next_world(int w) const {
    WorldView world = next_worlds[w];
    world.agents = next_agents;
    return world;
  }
  PICTURA_HD bool has_rejected_command() const { return *rejected_slot != kNoSlot; }
};

/// A world's boxes as one cell: a warp tests all of them sooner than they could be sorted.
PICTURA_HD inline GridView one_cell(Span<const int32_t> begin, Span<const int32_t> items) {
  constexpr float kWhole_m = 1e9f;
  return {{}, kWhole_m, 1, 1, begin, items};
}

/// The centre of a box for that cell: a box that is not drawn is far from everything.
PICTURA_HD inline Vec2 center_of(const AgentBox& box) {
  constexpr float kNowhere_m = 1e9f;
  return box.drawn ? box.center_m.xy() : Vec2{kNowhere_m, kNowhere_m};
}

/// What a team's threads share.
struct TeamMemory {
  int32_t lowest_changed;
};

/// Finds for each of `count` boxes, which are the world's from first_box on, the first of its tries that the map
/// permits and that is clear of the boxes before it: what placing them one after the other would find. As many as the
/// team has groups for choose at once, given what the others chose last, until nobody changes: then everybody's choice
/// agrees with the choices before it, which only the sequential result does. Every round fixes at least the lowest one
/// that changed. Choices of an earlier turn do not change.
///   box_of_try(i, try), permits(group, i, try, box)
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
  // The first tries of few boxes are looked at together.
  const int first_tries = clamp(kTurn / max_of(count, 1), 2, kSpawnTries);
  team.for_each(count, [&](int i) {
    boxes[i].drawn = 0;
    free_tries[i] = 0;
    known_tries[i] = 0;
    chosen_try[i] = -1;
  });
  // Whether the map, and what stands, leave a try free.
  const auto look_at = [&](const auto& group, int turn_begin, int i, int t) {
    const AgentBox box = box_of_try(i, t);
    const bool is_free = permits(group, i, t, box) && is_clear(world, box, first_box, first_box + turn_begin, group);
    if (is_free && group.rank() == 0) try_boxes[i * kSpawnTries + t] = box;
    return is_free;
  };
  // Looks at a box's tries until one is free of what stands and of what the boxes of this turn chose.
  const auto choose = [&](const auto& group, int turn_begin, int i) {
    uint32_t free = free_tries[i];
    int known = known_tries[i], chosen = -1;
    for (int t = 0; t < kSpawnTries && chosen < 0; ++t) {
      if (t == known) {
        ++known;
        if (look_at(group, turn_begin, i, t)) free |= 1u << t;
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
  for (int settled = 0, turn_begin = -kTurn; settled < count;) {
    if (settled >= turn_begin + kTurn) {
      turn_begin = settled;
      const int num_tries = min_of(kTurn, count - turn_begin) * first_tries;
      team.template for_each_by_groups<kThreadsPerAgent>(num_tries, [&](const auto& group, int k) {
        const int i = turn_begin + k / first_tries, t = k % first_tries;
        const bool is_free = look_at(group, turn_begin, i, t);
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
}

/// Begins the episode that `world` says; counts who found a place.
template <typename Team>
PICTURA_HD void begin_episode(const Team& team, const WorldView& world, const WorldScratch& scratch,
                              int32_t* spawned_out) {
  const int num_parked = world.num_boxes - world.num_agents;
  team.for_each(static_cast<int>(world.map.stop_lines.size()), [&](int light) { begin_light(world, light); });
  team.for_each(world.num_agents, [&](int agent) { draw_agent(world, agent); });
  const auto parked_at = [&](int car, int i) {
    return parked_box(world, car, world.map.parking_spots.empty() ? ParkingSpot{} : parking_spot(world, car, i));
  };
  choose_tries(team, world, scratch, world.num_agents, num_parked, parked_at,
               [&](const auto& group, int car, int i, const AgentBox& box) {
                 return !world.map.parking_spots.empty() &&
                        may_park(world.map, box, parking_spot(world, car, i), group);
               });
  team.for_each(num_parked, [&](int car) { put_parked_car(world, car, scratch.chosen_try[world.num_agents + car]); });
  const auto agent_at = [&](int agent, int i) {
    return has_places(world, agent) ? spawn_box(world, agent, i) : AgentBox{};
  };
  choose_tries(team, world, scratch, 0, world.num_agents, agent_at,
               [&](const auto& group, int agent, int, const AgentBox& box) {
                 return has_places(world, agent) && may_spawn(world.map, box, group) &&
                        is_clear(world, box, world.num_agents, world.num_boxes, group);
               });
  team.for_each(1, [&](int) { *spawned_out = 0; });
  team.template for_each_by_groups<kThreadsPerAgent>(world.num_agents, [&](const auto& group, int agent) {
    place_agent(world, agent, scratch.chosen_try[agent], group);
    if (group.rank() == 0 && joins_episode(world, scratch.chosen_try[agent])) team.add(spawned_out, 1);
  });
}

/// Begins episode 0 of `seed` in the worlds of the mask [worlds], or in all where it is null.
struct BeginFirstEpisode {
  PhaseArrays arrays;
  const uint8_t* mask;
  uint64_t seed;
  template <typename Team>
  PICTURA_HD void operator()(const Team& team, int w) const {
    if (mask && !mask[w]) return;
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

/// Says where the boxes of a world stand.
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

/// Makes a world's next episode, as early as its memory is free and long before it is needed: a start depends on
/// nothing that steps change.
struct PrepareEpisode {
  PhaseArrays arrays;
  template <typename Team>
  PICTURA_HD void operator()(const Team& team, int w) const {
    if (!arrays.prepares[w]) return;
    begin_episode(team, arrays.next_world(w), arrays.scratch[w], &arrays.next_spawned[w]);
  }
};

/// Finds the lowest slot whose command is out of range. Commands are actions or Commands, here and in what follows.
template <typename CommandType>
struct CheckCommands {
  PhaseArrays arrays;
  const CommandType* commands;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int slot) const {
    const WorldView world = arrays.world(arrays.world_of_slot[slot]);
    if (slot == world.first_slot) arrays.began[world.index] = 0;  // arrays.prepares says it now
    if (arrays.episode_over[world.index] || accepts(world, slot - world.first_slot, commands[slot])) return;
    atomics.lower(arrays.rejected_slot, slot);
  }
};

/// Moves an agent, or takes it into the episode that was prepared.
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
      const bool drives = takes_part(world, agent, command);
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

/// Collisions, reward and halt of an agent.
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

/// Counts a world's step, moves its lights on, and says whether its episode is over; or ends the move into its next
/// episode.
template <typename CommandType>
struct FinishStep {
  PhaseArrays arrays;
  const CommandType* commands;
  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int w) const {
    if (arrays.has_rejected_command()) return refuse(group, w);
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
  PICTURA_HD void refuse(const ThreadGroup& group, int w) const {
    if (w > 0 || group.rank() > 0 || *arrays.rejected_command != kNothingRejected) return;
    *arrays.rejected_command = rejected_command(*arrays.rejected_slot, commands[*arrays.rejected_slot]);
  }

  /// What belongs to no agent.
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

  /// Returns whether the episode is over.
  template <typename ThreadGroup>
  PICTURA_HD bool count(const ThreadGroup& group, int w, SimulatorTotals* totals_out) const {
    const WorldView world = arrays.world(w);
    const int steps = arrays.episode_step[w] + 1;
    constexpr int kParts =
        kTotalsBins / ThreadGroup::kSize;  // of the totals' bins, that one thread of the group sums up
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

  /// Counts in any order; sums in that of the totals' bins, see simulator/totals.h.
  template <typename ThreadGroup, int kParts>
  PICTURA_HD static void add_up(const ThreadGroup& group, SimulatorTotals (&parts)[kParts], SimulatorTotals* sum_out) {
    for (SimulatorTotals& part : parts) {
      SimulatorTotals::visit_counts(*sum_out, part, [&group](int64_t& sum, int64_t count) {
        sum += group.sum(static_cast<int>(count));  // at most a world's agents
      });
    }
    for (int lane = 0; lane < kTotalsBins; ++lane) {
      SimulatorTotals::visit_sums(
          *sum_out, parts[lane / ThreadGroup::kSize],
          [&group, lane](double& sum, double value) { sum += group.from(lane % ThreadGroup::kSize, value); });
    }
  }
};

/// Lets waiting agents into a world of roads that end, after a step that did not end its episode.
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

/// Writes what agents observe, a group of threads an observation.
class ObservationWriter {
 public:
  /// Floats that the rows of any set need in the memory of a group.
  static constexpr int kStaging = max_of(max_of(max_of(kMaxLanes, kMaxBoundaries), kMaxWalls) * kLaneFeatures,
                                         max_of(kMaxPartners* kPartnerFeatures, kMaxControls* kControlFeatures));

  /// observe_set() of every set, to that row of `out`.
  template <typename ThreadGroup, typename Observation>
  PICTURA_HD static void write_sets(const ThreadGroup& group, const WorldView& world, int agent,
                                    const Observation& observation, const ObservationView& out, int row) {
    for (int k = 0; k < num_observed_sets(out); ++k) {
      const auto set = static_cast<EntitySet>(k);
      write_set(group, world, agent, set, set_rows(out, row, set), observation);
    }
  }

 private:
  /// The rows are put together in the group's own memory, so that they are written whole and in order.
  template <typename ThreadGroup, typename Observation>
  PICTURA_HD static void write_set(const ThreadGroup& group, const WorldView& world, int agent, EntitySet set,
                                   const SetRows& out, const Observation& observation) {
    const int slot = world.first_slot + agent;
    float* rows = group.staging();
    int count = 0;
    if (observes(world, agent)) {
      const EgoFrame frame = ego_frame(world.agents, slot);
      const NearPlace place = near_place(world, slot);  // kept from set to set, it would be spilled
      if (set == EntitySet::partners) {
        count = observation.observe_partners(world, agent, frame, rows, group);
      } else if (set == EntitySet::controls) {
        count = observe_controls(world, slot, place, frame, rows, group);
      } else {
        count = collect_pieces(group, pieces_near(world.map, place, set), frame, out.capacity, rows);
      }
    }
    const int end = max_of(count, observation.num_filled(out));
    group.sync();
    group.write(rows, count * out.features, end * out.features, out.capacity * out.features, out.rows);
    if (group.rank() == 0) *out.count = count;
    group.sync();
  }

  /// observe_pieces() by several pieces a thread at a time, whose loads overlap.
  template <typename ThreadGroup>
  PICTURA_HD static int collect_pieces(const ThreadGroup& group, const PieceList& near, const EgoFrame& frame,
                                       int capacity, float* rows) {
    constexpr int kAtOnce = 2;
    const RowFrame row_frame(frame);
    const int num_items = static_cast<int>(near.items.size());
    int count = 0;
    for (int first = group.rank(); first - group.rank() < num_items && count < capacity;
         first += kAtOnce * group.size()) {
      ObservedPiece pieces[kAtOnce];
      for (int k = 0; k < kAtOnce; ++k) {
        const int i = min_of(first + k * group.size(), num_items - 1);
        pieces[k] = group.read(near.pieces[near.items[i]]);
      }
      for (int k = 0; k < kAtOnce; ++k) {
        float row[8];
        store8(observe_piece(pieces[k], row_frame), row);
        const bool is_seen = is_in_sight(pieces[k], frame) && first + k * group.size() < num_items;
        const uint32_t seen = group.ballot(is_seen);
        const int at = count + group.count_before(seen);
        for (int f = 0; f < kLaneFeatures && is_seen && at < capacity; ++f) rows[at * kLaneFeatures + f] = row[f];
        count = min_of(capacity, count + popcount(seen));
      }
    }
    return count;
  }
};

/// Writes a slot's view and observation.
struct WriteObservation {
  PhaseArrays arrays;
  static constexpr int kStaging = ObservationWriter::kStaging;

  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int slot) const {
    const WorldView world = arrays.world(arrays.world_of_slot[slot]);
    const int agent = slot - world.first_slot;
    observe_own(world, agent, slot, arrays.observations, group);
    if (group.rank() == group.size() - 1) arrays.views[slot] = view_of(world, agent);
    if (!arrays.entity_sets) return;
    ObservationWriter::write_sets(group, world, agent, StepObservation{}, arrays.observations, slot);
  }
};

/// Writes what a controller's rule tells a slot, where the mask has it.
template <typename Rule>
struct WriteCommands {
  Rule rule;
  const uint8_t* mask;  // null: all
  Command* commands_out;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int slot) const {
    if (!mask || mask[slot]) commands_out[slot] = rule(static_cast<size_t>(slot));
  }
};

template <typename Launch>
void launch_write_observations(const Launch& launch, const PhaseArrays& arrays) {
  launch.template groups<kWarp>(arrays.num_slots, WriteObservation{arrays});
}

/// Notes which element of an edit names a slot first.
struct MarkEdit {
  PhaseArrays arrays;
  StateEdit edit;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int i) const {
    if (has_slot(edit, i, arrays.num_slots)) atomics.lower(&arrays.first_element[edit.slots[i]], i);
  }
};

PICTURA_HD inline int64_t find_fault(const PhaseArrays& arrays, const StateEdit& edit, int i) {
  return find_edit_fault(edit, i, arrays.num_slots, arrays.first_element,
                         [&arrays](int slot) { return arrays.world(arrays.world_of_slot[slot]); });
}
PICTURA_HD inline int64_t find_fault(const PhaseArrays& arrays, const ObservationQueries& asked, int i) {
  return find_query_fault(asked, i, arrays.num_slots,
                          [&arrays](int slot) { return arrays.world(arrays.world_of_slot[slot]); });
}
static_assert(kNoQueryFault == kNothingWrong);

/// Finds the first element with a fault of an edit, or of queries.
template <typename Request>
struct CheckRequest {
  PhaseArrays arrays;
  Request request;
  PICTURA_HD int64_t fault(int i) const { return find_fault(arrays, request, i); }
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int i) const {
    if (fault(i) != kNothingWrong) atomics.lower(arrays.wrong_element, i);
  }
};

/// Puts the agents of an edit without faults into their worlds.
struct ApplyEdit {
  CheckRequest<StateEdit> check;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int i) const {
    const PhaseArrays& arrays = check.arrays;
    if (*arrays.wrong_element != kNoSlot) {
      if (i == 0 && *arrays.wrong_edit == kNothingWrong) *arrays.wrong_edit = check.fault(*arrays.wrong_element);
      return;
    }
    const int slot = check.request.slots[i], w = arrays.world_of_slot[slot];
    const WorldView world = arrays.world(w);
    if (const int joined = apply_edit(world, check.request, i)) atomics.add(&arrays.spawned[w], joined);
    const int agent = slot - world.first_slot;
    world.cell_centers[agent] = center_of(world.boxes[agent]);
  }
};

template <typename Launch>
void launch_edit(const Launch& launch, const PhaseArrays& arrays, const StateEdit& edit) {
  if (edit.count == 0) return;
  launch.fill(arrays.first_element, static_cast<size_t>(arrays.num_slots) * sizeof(int32_t), kNoSlot & 0xFF);
  launch.fill(arrays.wrong_element, sizeof(int32_t), kNoSlot & 0xFF);
  launch.threads(edit.count, MarkEdit{arrays, edit});
  launch.threads(edit.count, CheckRequest<StateEdit>{arrays, edit});
  launch.threads(edit.count, ApplyEdit{{arrays, edit}});
  launch_write_observations(launch, arrays);
}

/// Keeps what is wrong with the first query that has a fault until the host looks.
struct LatchQueryFault {
  CheckRequest<ObservationQueries> check;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int) const {
    const int32_t wrong = *check.arrays.wrong_element;
    if (wrong != kNoSlot && *check.arrays.wrong_query == kNoQueryFault) *check.arrays.wrong_query = check.fault(wrong);
  }
};

/// answer_query(), unless there is a fault in any.
struct AnswerQueries {
  PhaseArrays arrays;
  ObservationQueries asked;
  static constexpr int kStaging = ObservationWriter::kStaging;

  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int i) const {
    if (*arrays.wrong_element != kNoSlot) return;
    const ObservationQuery& query = asked.queries[i];
    const WorldView world = arrays.world(arrays.world_of_slot[query.slot]);
    const int agent = query.slot - world.first_slot;
    observe_own(world, agent, i, asked.out, group);
    if (!arrays.entity_sets) return;
    ObservationWriter::write_sets(group, world, agent, QueriedObservation(asked, query), asked.out, i);
    if (group.rank() == 0) clear_other_counts(asked.out, i);
  }
};

template <typename Launch>
void launch_queries(const Launch& launch, const PhaseArrays& arrays, const ObservationQueries& asked) {
  const auto count = static_cast<int32_t>(asked.queries.size());
  if (count == 0) return;
  launch.fill(arrays.wrong_element, sizeof(int32_t), kNoSlot & 0xFF);
  launch.threads(count, CheckRequest<ObservationQueries>{arrays, asked});
  launch.threads(1, LatchQueryFault{{arrays, asked}});
  launch.template groups<kWarp>(count, AnswerQueries{arrays, asked});
}

/// Episode 0 of `seed` in the worlds of the mask, or in all where it is null.
template <typename Launch>
void launch_reset(const Launch& launch, const PhaseArrays& arrays, const uint8_t* mask, uint64_t seed) {
  launch.teams(arrays.num_worlds, BeginFirstEpisode{arrays, mask, seed});
  launch.template groups<kWarp>(arrays.num_worlds, PlaceCenters{arrays});
  launch_write_observations(launch, arrays);
}

/// Tells the worlds which episode of which seed a state that was put there is in.
struct TakeEpisode {
  PhaseArrays arrays;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int w) const {
    arrays.worlds[w].seed = arrays.next_worlds[w].seed = arrays.seed[w];
    arrays.worlds[w].episode = static_cast<uint32_t>(arrays.episode_index[w]);
    arrays.next_worlds[w].episode = arrays.worlds[w].episode + 1;
  }
};

/// Shows a state that was put there.
template <typename Launch>
void launch_restored(const Launch& launch, const PhaseArrays& arrays) {
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
  launch_write_observations(launch, arrays);
}

template <typename Launch, typename CommandType>
void launch_step(const Launch& launch, const PhaseArrays& arrays, const CommandType* commands) {
  launch.copy(arrays.prepares, arrays.began, static_cast<size_t>(arrays.num_worlds));
  launch.fork_join([&](const Launch& side) { side.teams(arrays.num_worlds, PrepareEpisode{arrays}); },
                   [&] {
                     launch.fill(arrays.rejected_slot, sizeof(int32_t), kNoSlot & 0xFF);
                     launch.threads(arrays.num_slots, CheckCommands<CommandType>{arrays, commands});
                     launch.template groups<kThreadsPerAgent>(arrays.num_slots, Advance<CommandType>{arrays, commands});
                     launch.template groups<kThreadsPerAgent>(arrays.num_slots, ApplyRewardAndHalt{arrays});
                     launch.template groups<kWarp>(arrays.num_worlds, FinishStep<CommandType>{arrays, commands});
                     if (arrays.has_lives) launch.template groups<kWarp>(arrays.num_worlds, EnterWaiting{arrays});
                     launch_write_observations(launch, arrays);
                   });
}

}  // namespace pictura::cuda
