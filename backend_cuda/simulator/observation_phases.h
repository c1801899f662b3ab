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
    const int num_sets = num_observed_sets(out);
    const NearLists<ThreadGroup> near(group, world.map, near_place(world, world.first_slot + agent), num_sets);
    write_set<EntitySet::partners>(group, world, agent, observation, out, row, hidden, near);
    write_set<EntitySet::lanes>(group, world, agent, observation, out, row, hidden, near);
    write_set<EntitySet::boundaries>(group, world, agent, observation, out, row, hidden, near);
    write_set<EntitySet::controls>(group, world, agent, observation, out, row, hidden, near);
    if (num_sets < kNumEntitySets) return;
    write_set<EntitySet::walls>(group, world, agent, observation, out, row, hidden, near);
  }

 private:
  /// Bounds of an agent's lists of pieces and stop lines. The group's threads load the bounds of all sets at once, and
  /// share them out: a warp's thread 2 k keeps the begin, and thread 2 k + 1 the end, of set k's list.
  template <typename ThreadGroup>
  class NearLists {
   public:
    PICTURA_HD NearLists(const ThreadGroup& group, const MapView& map, NearPlace place, int num_sets) {
      for (int i = 0; i < kPerThread; ++i) {
        const int bound = i * ThreadGroup::kSize + group.rank();
        const auto set = static_cast<EntitySet>(bound / 2);
        if (set == EntitySet::partners || bound >= 2 * num_sets) continue;
        bounds_[i] = lists_near(map, set).begin[list_index(place, set) + static_cast<uint32_t>(bound % 2)];
      }
    }
    /// Returns the same as items_near(). All threads of the group must call it.
    PICTURA_HD Span<const int32_t> items(const ThreadGroup& group, const MapView& map, EntitySet set) const {
      const int first = 2 * static_cast<int>(set);
      const int32_t begin = bound(group, first);
      return lists_near(map, set).items.subspan(begin, bound(group, first + 1) - begin);
    }

   private:
    PICTURA_HD int32_t bound(const ThreadGroup& group, int index) const {
      return group.from(index % ThreadGroup::kSize, bounds_[kPerThread == 1 ? 0 : index / ThreadGroup::kSize]);
    }
    static constexpr int kPerThread = (2 * kNumEntitySets + ThreadGroup::kSize - 1) / ThreadGroup::kSize;
    int32_t bounds_[kPerThread] = {};
  };

  /// Assembles the rows in the group's own memory, so that they are written whole and in order. The set is a template
  /// argument, because a loop over sets would keep more values than a thread has registers.
  template <EntitySet set, typename ThreadGroup, typename Observation>
  PICTURA_HD static void write_set(const ThreadGroup& group, const WorldView& world, int agent,
                                   const Observation& observation, const ObservationView& all_out, int row,
                                   Hides hidden, const NearLists<ThreadGroup>& near) {
    const SetRows out = set_rows(all_out, row, set);
    const int slot = world.first_slot + agent;
    float* rows = group.staging();
    int count = 0;
    if (observes_set(world, agent, set, hidden)) {
      const EgoFrame frame = ego_frame(world.agents, slot);
      if constexpr (set == EntitySet::partners) {
        count = observation.observe_partners(world, agent, frame, rows, group);
      } else if constexpr (set == EntitySet::controls) {
        count = observe_controls(world, slot, near.items(group, world.map, set), frame, rows, group);
      } else {
        const PieceList pieces = piece_list(world.map, set, near.items(group, world.map, set));
        count = collect_pieces(group, pieces, frame, out.capacity, rows);
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
