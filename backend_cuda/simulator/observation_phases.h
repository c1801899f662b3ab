// Phases that write the observations of agents.
#pragma once

#include "pictura/backend_cuda/simulator/phase_arrays.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/simulator/rules/observe_query.h"

namespace pictura::cuda {

/// Writes observations, one group of threads per observation.
class ObservationWriter {
 public:
  /// Maximum number of floats of one set's rows.
  static constexpr int kStaging = max_of(max_of(max_of(kMaxLanes, kMaxBoundaries), kMaxWalls) * kLaneFeatures,
                                         max_of(kMaxPartners* kPartnerFeatures, kMaxControls* kControlFeatures));

  /// Writes every set to a row of `out`, as observe_set() does.
  template <typename ThreadGroup, typename Observation>
  PICTURA_HD static void write_sets(const ThreadGroup& group, const WorldView& world, int agent,
                                    const Observation& observation, const ObservationView& out, int row, Hides hidden) {
    for (int k = 0; k < num_observed_sets(out); ++k) {
      const auto set = static_cast<EntitySet>(k);
      write_set(group, world, agent, set, set_rows(out, row, set), observation, hidden);
    }
  }

 private:
  /// Assembles the rows in the group's own memory, so that they are written whole and in order.
  template <typename ThreadGroup, typename Observation>
  PICTURA_HD static void write_set(const ThreadGroup& group, const WorldView& world, int agent, EntitySet set,
                                   const SetRows& out, const Observation& observation, Hides hidden) {
    const int slot = world.first_slot + agent;
    float* rows = group.staging();
    int count = 0;
    if (observes_set(world, agent, set, hidden)) {
      const EgoFrame frame = ego_frame(world.agents, slot);
      const NearPlace place = near_place(world, slot);  // recomputed, to save registers
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

  /// Version of observe_pieces() with overlapping loads.
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
        write_piece(pieces[k], row_frame, row);
        const bool is_visible = is_in_sight(pieces[k], frame) && first + k * group.size() < num_items;
        const uint32_t seen = group.ballot(is_visible);
        const int at = count + group.count_before(seen);
        for (int f = 0; f < kLaneFeatures && is_visible && at < capacity; ++f) rows[at * kLaneFeatures + f] = row[f];
        count = min_of(capacity, count + popcount(seen));
      }
    }
    return count;
  }
};

/// Writes a slot's view and observation. This last phase of a launch also prepares the check of the next commands.
struct WriteObservation {
  PhaseArrays arrays;
  static constexpr int kStaging = ObservationWriter::kStaging;

  template <typename ThreadGroup>
  PICTURA_HD void operator()(const ThreadGroup& group, int slot) const {
    const WorldView world = arrays.world(arrays.world_of_slot[slot]);
    const int agent = slot - world.first_slot;
    if (slot == 0 && group.rank() == 0) *arrays.rejected_slot = kNoSlot;
    observe_own(world, agent, slot, arrays.observations, group);
    const Hides hidden = hidden_from(world, agent);
    if (group.rank() == group.size() - 1) {
      arrays.views[slot] = view_of(world, agent, hidden);
      arrays.driver[slot] = static_cast<uint8_t>(driver_of(driver_kind_of(world, agent)));
    }
    if (!arrays.entity_sets) return;
    ObservationWriter::write_sets(group, world, agent, StepObservation{}, arrays.observations, slot, hidden);
  }
};

template <typename Launch>
void launch_write_observations(const Launch& launch, const PhaseArrays& arrays) {
  launch.template groups<kWarp>(arrays.num_slots, WriteObservation{arrays});
}

}  // namespace pictura::cuda
