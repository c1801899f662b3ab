// The CUDA executor's step as phases over agents and worlds, each of which reads only what an earlier one has finished.
// They say what every thread does and not how threads are started, so that a host can run them too, in any order:
//   threads  one thread per item: phase(atomics, item)
//   teams    threads that wait for each other, one team per world: phase(team, world)
//   warps    lanes in lockstep, one warp per item: phase(lanes, item)
// simulator_cuda_kernel.cu starts them on a device; tests/simulator/shuffled_launch.h on a host.
#pragma once

#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/simulator/rules/spawn.h"

namespace pictura::cuda {

/// One world's memory for sorting and spawning.
struct WorldScratch {
  int32_t* cell_begin = nullptr;  // of the world's box_cells, as the following
  int32_t* cell_items = nullptr;
  uint32_t* free_tries = nullptr;  // [boxes] which of its tries the map permits, as bits
  int32_t* chosen_try = nullptr;   // [boxes] -1: none
  int32_t* next_try = nullptr;     // [boxes]
};

/// What no step has as its lowest slot with an action out of range. All its bytes are equal, for memset.
constexpr int32_t kNoSlot = 0x7F7F7F7F;

/// An action that a step refused, in one word that the host reads whole: slot and action, or -1 for none.
PICTURA_HD constexpr int64_t refusal(int32_t slot, int32_t action) {
  return (static_cast<int64_t>(slot) << 32) | static_cast<uint32_t>(action);
}

/// Everything that the phases read and write, in one memory.
struct SimulatorArrays {
  WorldView* worlds = nullptr;             // [num_worlds]
  const WorldScratch* scratch = nullptr;   // [num_worlds]
  const int32_t* world_of_slot = nullptr;  // [num_slots]
  int32_t num_worlds = 0, num_slots = 0;
  // State, as in WorldBatch.
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
  // Of the present step.
  uint8_t* begins = nullptr;        // [num_worlds] an episode begins in it
  int32_t* refused_slot = nullptr;  // the lowest one with an action out of range, or kNoSlot
  int64_t* refusal = nullptr;       // the first since the host looked, or -1

  PICTURA_HD const WorldView& world_of(int slot) const { return worlds[world_of_slot[slot]]; }
  PICTURA_HD bool is_refused() const { return *refused_slot != kNoSlot; }
};

/// What a team's threads share.
struct TeamMemory {
  static constexpr int kParts = 64;
  SimulatorTotals lanes[kTotalsLanes];
  int32_t parts[kParts];
  int32_t value;
};

/// Sorts the boxes that stand anywhere into their cells, by counting. Within a cell they come in any order, on which no
/// rule depends.
template <typename Team>
PICTURA_HD void sort_into_cells(const Team& team, const WorldView& world, const WorldScratch& scratch) {
  const GridView& cells = world.box_cells;
  const int num_cells = cells.num_x * cells.num_y;
  int32_t* begin = scratch.cell_begin;
  const auto cell_of = [&](const AgentBox& box) {
    return cells.cell_y(box.center_m.y) * cells.num_x + cells.cell_x(box.center_m.x);
  };
  team.for_each(num_cells + 1, [&](int cell) { begin[cell] = 0; });
  team.for_each(world.num_boxes, [&](int i) {
    if (world.boxes[i].drawn) team.add(&begin[cell_of(world.boxes[i])], 1);
  });
  // The end of each cell, for now: sums of equal parts of the cells, then within them.
  const int per_part = num_cells / TeamMemory::kParts + 1;
  const auto end_of = [&](int part) { return min_of((part + 1) * per_part, num_cells + 1); };
  int32_t* parts = team.memory().parts;
  team.for_each(TeamMemory::kParts, [&](int part) {
    int32_t sum = 0;
    for (int cell = part * per_part; cell < end_of(part); ++cell) sum += begin[cell];
    parts[part] = sum;
  });
  team.for_each(TeamMemory::kParts, [&](int part) {
    int32_t sum = 0;
    for (int before = 0; before < part; ++before) sum += parts[before];
    for (int cell = part * per_part; cell < end_of(part); ++cell) begin[cell] = sum += begin[cell];
  });
  team.for_each(world.num_boxes, [&](int i) {
    if (world.boxes[i].drawn) scratch.cell_items[team.add(&begin[cell_of(world.boxes[i])], -1) - 1] = i;
  });
}

/// Finds for each of `count` boxes, which are the world's from first_box on, the first of its tries that the map
/// permits and that is clear of the boxes before it: what placing them one after the other would find. All choose at
/// once, given what the others chose last, until nobody changes: then everybody's choice agrees with the choices before
/// it, which only the sequential result does. Every round settles at least the lowest one that changed.
template <typename Team, typename BoxOfTry, typename Permits>
PICTURA_HD void choose_tries(const Team& team, const WorldView& world, const WorldScratch& scratch, int first_box,
                             int count, const BoxOfTry& box_of_try, const Permits& permits) {
  static_assert(kSpawnTries <= 32);
  AgentBox* boxes = world.boxes + first_box;
  uint32_t* free_tries = scratch.free_tries + first_box;
  int32_t* chosen_try = scratch.chosen_try + first_box;
  int32_t* next_try = scratch.next_try + first_box;
  team.for_each(count, [&](int i) {
    boxes[i].drawn = 0;
    free_tries[i] = 0;
    chosen_try[i] = -1;
  });
  team.for_each(count * kSpawnTries, [&](int k) {
    if (permits(k / kSpawnTries, k % kSpawnTries)) team.set_bits(&free_tries[k / kSpawnTries], 1u << (k % kSpawnTries));
  });
  int32_t& lowest_changed = team.memory().value;
  for (int settled = 0; settled < count;) {
    team.for_each(1, [&](int) { lowest_changed = count; });
    team.for_each(count - settled, [&](int k) {
      const int i = settled + k;
      next_try[i] = -1;
      for (int t = 0; t < kSpawnTries && next_try[i] < 0; ++t) {
        if ((free_tries[i] >> t & 1u) && is_clear(world, box_of_try(i, t), first_box, first_box + i)) next_try[i] = t;
      }
      if (next_try[i] != chosen_try[i]) team.lower(&lowest_changed, i);
    });
    const int changed = lowest_changed;
    team.for_each(count - settled, [&](int k) {
      const int i = settled + k;
      if (next_try[i] == chosen_try[i]) return;
      chosen_try[i] = next_try[i];
      if (chosen_try[i] >= 0) boxes[i] = box_of_try(i, chosen_try[i]);
      boxes[i].drawn = chosen_try[i] >= 0;
    });
    settled = changed + 1;
  }
}

template <typename Team>
PICTURA_HD void begin_episode(const Team& team, const SimulatorArrays& arrays, int w) {
  const WorldView& world = arrays.worlds[w];
  const WorldScratch& scratch = arrays.scratch[w];
  const int num_parked = world.num_boxes - world.num_agents;
  team.for_each(static_cast<int>(world.map.stop_lines.size()), [&](int light) { begin_light(world, light); });
  team.for_each(world.num_agents, [&](int agent) { draw_agent(world, agent); });
  const auto parked_at = [&](int car, int i) { return parked_box(world, car, parking_spot(world, car, i)); };
  choose_tries(team, world, scratch, world.num_agents, num_parked, parked_at, [&](int car, int i) {
    return !world.map.parking_spots.empty() && may_park(world.map, parked_at(car, i), parking_spot(world, car, i));
  });
  team.for_each(num_parked, [&](int car) { put_parked_car(world, car, scratch.chosen_try[world.num_agents + car]); });
  const auto agent_at = [&](int agent, int i) { return spawn_box(world, agent, i); };
  choose_tries(team, world, scratch, 0, world.num_agents, agent_at, [&](int agent, int i) {
    if (!has_places(world, agent)) return false;
    const AgentBox box = spawn_box(world, agent, i);
    return may_spawn(world.map, box) && is_clear(world, box, world.num_agents, world.num_boxes);
  });
  team.for_each(1, [&](int) { arrays.spawned[w] = 0; });
  team.for_each(world.num_agents, [&](int agent) {
    put_agent(world, agent, scratch.chosen_try[agent]);
    if (scratch.chosen_try[agent] >= 0) team.add(&arrays.spawned[w], 1);
  });
  sort_into_cells(team, world, scratch);
}

/// Finds the lowest slot whose action is out of range.
struct CheckActions {
  SimulatorArrays arrays;
  const int32_t* actions;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int slot) const {
    const WorldView& world = arrays.world_of(slot);
    if (arrays.episode_over[world.index] || is_sound_action(world, slot - world.first_slot, actions[slot])) return;
    atomics.lower(arrays.refused_slot, slot);
  }
};

/// Counts the step of each world, or begins its next episode.
struct BeginStep {
  SimulatorArrays arrays;
  const int32_t* actions;
  template <typename Team>
  PICTURA_HD void operator()(const Team& team, int w) const {
    if (arrays.is_refused()) {
      team.for_each(w == 0, [&](int) {
        if (*arrays.refusal < 0) *arrays.refusal = refusal(*arrays.refused_slot, actions[*arrays.refused_slot]);
      });
      return;
    }
    team.for_each(1, [&](int) {
      arrays.begins[w] = arrays.episode_over[w];
      arrays.world_totals[w].slot_steps += arrays.worlds[w].num_agents;
      ++arrays.episode_step[w];
      if (!arrays.begins[w]) return;
      arrays.episode_over[w] = 0;
      arrays.episode_step[w] = 0;
      arrays.worlds[w].episode = static_cast<uint32_t>(++arrays.episode_index[w]);
      ++arrays.world_totals[w].episodes;
    });
    if (arrays.begins[w]) begin_episode(team, arrays, w);
  }
};

/// Begins episode 0 in every world.
struct BeginFirstEpisode {
  SimulatorArrays arrays;
  template <typename Team>
  PICTURA_HD void operator()(const Team& team, int w) const {
    team.for_each(1, [&](int) {
      arrays.episode_over[w] = 0;
      arrays.episode_step[w] = arrays.episode_index[w] = 0;
      arrays.worlds[w].episode = 0;
    });
    begin_episode(team, arrays, w);
  }
};

struct Advance {
  SimulatorArrays arrays;
  const int32_t* actions;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int slot) const {
    if (arrays.is_refused()) return;
    const WorldView& world = arrays.world_of(slot);
    if (arrays.begins[world.index]) return clear_result(arrays.results, slot);
    const int agent = slot - world.first_slot;
    arrays.results.valid[slot] = is_active(world, agent);
    advance(world, agent, actions[slot]);
  }
};

struct SortBoxes {
  SimulatorArrays arrays;
  template <typename Team>
  PICTURA_HD void operator()(const Team& team, int w) const {
    if (arrays.is_refused() || arrays.begins[w]) return;
    sort_into_cells(team, arrays.worlds[w], arrays.scratch[w]);
  }
};

struct FindCollisions {
  SimulatorArrays arrays;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int slot) const {
    if (arrays.is_refused()) return;
    const WorldView& world = arrays.world_of(slot);
    if (!arrays.begins[world.index]) find_collisions(world, slot - world.first_slot);
  }
};

/// Rewards, halts and counts, the next state of the lights, and whether the episode is over.
struct FinishStep {
  SimulatorArrays arrays;
  template <typename Team>
  PICTURA_HD void operator()(const Team& team, int w) const {
    if (arrays.is_refused() || arrays.begins[w]) return;
    const WorldView& world = arrays.worlds[w];
    TeamMemory& memory = team.memory();
    const int steps = arrays.episode_step[w];
    team.for_each(kTotalsLanes, [&](int lane) {
      SimulatorTotals totals;
      int32_t active = 0;
      for (int agent = lane; agent < world.num_agents; agent += kTotalsLanes) {
        active += settle_and_count(world, agent, arrays.results, &totals);
      }
      memory.lanes[lane] = totals;
      memory.parts[lane] = active;
    });
    team.for_each(static_cast<int>(world.map.stop_lines.size()),
                  [&](int light) { world.lights[light] = light_state(world.light_plans[light], steps); });
    int32_t active = 0;
    for (int lane = 0; lane < kTotalsLanes; ++lane) active += memory.parts[lane];
    const bool ends = episode_ends(world.options, steps, arrays.spawned[w], active);
    team.for_each(kTotalsLanes, [&](int lane) {
      for (int agent = lane; agent < world.num_agents; agent += kTotalsLanes) {
        finish_agent(world, agent, ends, arrays.results, &memory.lanes[lane]);
      }
    });
    team.for_each(1, [&](int) {
      SimulatorTotals sum;
      for (int lane = 0; lane < kTotalsLanes; ++lane) sum.add(memory.lanes[lane]);
      arrays.world_totals[w].add(sum);
      arrays.episode_over[w] = ends;
    });
  }
  static_assert(kTotalsLanes <= TeamMemory::kParts);
};

/// What of a slot's observation one thread writes: itself and its view, or one of the sets.
struct ShowAgent {
  SimulatorArrays arrays;
  static constexpr int kParts = 3;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int item) const {
    const int part = item / arrays.num_slots, slot = item % arrays.num_slots;
    const WorldView& world = arrays.world_of(slot);
    const int agent = slot - world.first_slot;
    if (part == 1) return observe_set(world, agent, EntitySet::partners, arrays.observations);
    if (part == 2) return observe_set(world, agent, EntitySet::controls, arrays.observations);
    observe_own(world, agent, arrays.observations);
    arrays.views[slot] = view_of(world, agent);
  }
};

/// Lanes, boundaries or walls of a slot, as many pieces at a time as the warp has lanes.
struct ShowPieces {
  SimulatorArrays arrays;
  PICTURA_HD int num_sets() const { return arrays.observations.walls.empty() ? 2 : 3; }
  template <typename Lanes>
  PICTURA_HD void operator()(const Lanes& lanes, int item) const {
    constexpr EntitySet kSets[3] = {EntitySet::lanes, EntitySet::boundaries, EntitySet::walls};
    const int slot = item / num_sets();
    const EntitySet set = kSets[item % num_sets()];
    const WorldView& world = arrays.world_of(slot);
    const SetRows rows = set_rows(arrays.observations, slot, set);
    int count = 0;
    if (observes(world, slot - world.first_slot)) {
      const EgoFrame frame = ego_frame(world.agents, slot);
      const PieceList near = pieces_near(world, slot, set);
      const int num_items = static_cast<int>(near.items.size());
      for (int first = 0; first < num_items && count < rows.capacity; first += lanes.size()) {
        const int i = first + lanes.rank();
        float row[kLaneFeatures];
        const bool in_sight =
            i < num_items &&
            observe_piece(near.pieces[static_cast<size_t>(near.items[static_cast<size_t>(i)])], frame, row);
        const uint32_t seen = lanes.ballot(in_sight);
        const int at = count + lanes.count_before(seen);
        for (int f = 0; f < kLaneFeatures && in_sight && at < rows.capacity; ++f) {
          rows.rows[at * kLaneFeatures + f] = row[f];
        }
        count = min_of(rows.capacity, count + lanes.count(seen));
      }
    }
    for (int i = count * kLaneFeatures + lanes.rank(); i < *rows.count * kLaneFeatures; i += lanes.size()) {
      rows.rows[i] = 0.0f;
    }
    lanes.wait();
    if (lanes.rank() == 0) *rows.count = count;
  }
};

template <typename Launch>
void launch_show(const Launch& launch, const SimulatorArrays& arrays) {
  launch.threads((arrays.entity_sets ? ShowAgent::kParts : 1) * arrays.num_slots, ShowAgent{arrays});
  const ShowPieces pieces{arrays};
  if (arrays.entity_sets) launch.warps(pieces.num_sets() * arrays.num_slots, pieces);
}

/// Episode 0 of every world.
template <typename Launch>
void launch_reset(const Launch& launch, const SimulatorArrays& arrays) {
  launch.teams(arrays.num_worlds, BeginFirstEpisode{arrays});
  launch_show(launch, arrays);
}

/// Shows a state that was put there.
template <typename Launch>
void launch_restored(const Launch& launch, const SimulatorArrays& arrays) {
  launch.fill(arrays.refused_slot, sizeof(int32_t), kNoSlot & 0xFF);
  launch.fill(arrays.begins, static_cast<size_t>(arrays.num_worlds), 0);
  launch.teams(arrays.num_worlds, SortBoxes{arrays});
  launch_show(launch, arrays);
}

template <typename Launch>
void launch_step(const Launch& launch, const SimulatorArrays& arrays, const int32_t* actions) {
  launch.fill(arrays.refused_slot, sizeof(int32_t), kNoSlot & 0xFF);
  launch.threads(arrays.num_slots, CheckActions{arrays, actions});
  launch.teams(arrays.num_worlds, BeginStep{arrays, actions});
  launch.threads(arrays.num_slots, Advance{arrays, actions});
  launch.teams(arrays.num_worlds, SortBoxes{arrays});
  launch.threads(arrays.num_slots, FindCollisions{arrays});
  launch.teams(arrays.num_worlds, FinishStep{arrays});
  launch_show(launch, arrays);
}

}  // namespace pictura::cuda
