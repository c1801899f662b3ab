// Phases of requests between steps: edits, queries of observations, commands of controllers.
#pragma once

#include "pictura/backend_cuda/simulator/reset_phases.h"
#include "pictura/simulator/rules/edit_state.h"

namespace pictura::cuda {

/// Records, for each slot, the first element of an edit that names it.
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
static_assert(kNoQueryFault == kNoEditFault);

/// Finds the first faulty element.
template <typename Request>
struct CheckRequest {
  PhaseArrays arrays;
  Request request;
  PICTURA_HD int64_t fault(int i) const { return find_fault(arrays, request, i); }
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int i) const {
    if (fault(i) != kNoEditFault) atomics.lower(arrays.faulty_element, i);
  }
};

/// Writes an edit if it has no faults; otherwise keeps the first fault.
struct ApplyEdit {
  CheckRequest<StateEdit> check;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics& atomics, int i) const {
    const PhaseArrays& arrays = check.arrays;
    if (*arrays.faulty_element != kNoSlot) {
      if (i == 0 && *arrays.faulty_edit == kNoEditFault) *arrays.faulty_edit = check.fault(*arrays.faulty_element);
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
  launch.fill(arrays.faulty_element, sizeof(int32_t), kNoSlot & 0xFF);
  launch.threads(edit.count, MarkEdit{arrays, edit});
  launch.threads(edit.count, CheckRequest<StateEdit>{arrays, edit});
  launch.threads(edit.count, ApplyEdit{{arrays, edit}});
  launch_sort_boxes(launch, arrays);
  launch_write_observations(launch, arrays);
}

/// Keeps the first query fault until the host checks.
struct LatchQueryFault {
  CheckRequest<ObservationQueries> check;
  template <typename Atomics>
  PICTURA_HD void operator()(const Atomics&, int) const {
    const int32_t wrong = *check.arrays.faulty_element;
    if (wrong != kNoSlot && *check.arrays.faulty_query == kNoQueryFault)
      *check.arrays.faulty_query = check.fault(wrong);
  }
};

/// Runs answer_query(), unless any query has a fault.
struct AnswerQueries {
  PhaseArrays arrays;
  ObservationQueries asked;
  static constexpr int kStaging = ObservationWriter::kStaging;

  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int i) const {
    if (*arrays.faulty_element != kNoSlot) return;
    const ObservationQuery& query = asked.queries[i];
    const WorldView world = arrays.world(arrays.world_of_slot[query.slot]);
    const int agent = query.slot - world.first_slot;
    observe_own(world, agent, i, asked.out, group);
    if (!arrays.entity_sets) return;
    ObservationWriter::write_sets(group, world, agent, QueriedObservation(asked, query), asked.out, i,
                                  hidden_from(world, agent));
    if (group.rank() == 0) clear_other_counts(asked.out, i);
  }
};

template <typename Launch>
void launch_queries(const Launch& launch, const PhaseArrays& arrays, const ObservationQueries& asked) {
  const auto count = static_cast<int32_t>(asked.queries.size());
  if (count == 0) return;
  launch.fill(arrays.faulty_element, sizeof(int32_t), kNoSlot & 0xFF);
  launch.threads(count, CheckRequest<ObservationQueries>{arrays, asked});
  launch.threads(1, LatchQueryFault{{arrays, asked}});
  launch.template groups<kWarp>(count, AnswerQueries{arrays, asked});
}

/// Writes commands to the mask's slots.
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

}  // namespace pictura::cuda
