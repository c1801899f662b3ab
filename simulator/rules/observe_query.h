// Hypothetical observations; see Simulator::observe().
#pragma once

#include "pictura/simulator/observation_query.h"
#include "pictura/simulator/rules/observe.h"

namespace pictura {

/// Argument of observe_set() for a query. The destination may contain any values.
class QueriedObservation {
 public:
  PICTURA_HD QueriedObservation(const ObservationQueries& asked, const ObservationQuery& query)
      : hidden_(part(asked.hidden, query.hidden_begin, query.hidden_end)),
        inserted_(part(asked.inserted, query.inserted_begin, query.inserted_end)),
        leaves_gaps_(query.leaves_gaps != 0) {}

  PICTURA_HD static int num_filled(const SetRows& set) { return set.capacity; }

  template <typename ThreadGroup>
  PICTURA_HD int observe_partners(const WorldView& world, int agent, const EgoFrame& frame, float* rows,
                                  const ThreadGroup& group) const {
    const auto nearest = nearest_partners(world, agent, frame.origin_m.xy(), group);
    const int count = nearest.count();
    const RowFrame row_frame(frame);
    for (int i = group.rank(); i < count; i += group.size()) {
      float* out = rows + i * kPartnerFeatures;
      const int item = nearest.item(i);
      if (item >= world.num_boxes) {
        const InsertedBox& one = inserted_[item - world.num_boxes];
        write_partner(one.box, world.options.auxiliary_observations ? one.speed_mps : 0.0f, row_frame, out);
      } else if (leaves_gaps_ && hides(world, item)) {
        for (int f = 0; f < kPartnerFeatures; ++f) out[f] = 0.0f;
      } else {
        write_partner(world.boxes[item], observed_speed_mps(world, item), row_frame, out);
      }
    }
    return count;
  }

 private:
  template <typename T>
  PICTURA_HD static Span<T> part(Span<T> list, int32_t begin, int32_t end) {
    return list.subspan(begin, end - begin);
  }
  PICTURA_HD bool hides(const WorldView& world, int box) const {
    for (const int32_t hidden : hidden_) {
      if (hidden == world.first_box + box) return true;
    }
    return false;
  }

  /// Excludes hidden boxes and includes inserted boxes: item num_boxes + i is inserted box i.
  template <typename ThreadGroup>
  PICTURA_HD auto nearest_partners(const WorldView& world, int agent, Vec2 origin, const ThreadGroup& group) const {
    const auto box_at = [&](int item) -> const AgentBox& {
      return item < world.num_boxes ? world.boxes[item] : inserted_[item - world.num_boxes].box;
    };
    const auto is_present = [&](int item) {
      return item >= world.num_boxes || (item != agent && (leaves_gaps_ || !hides(world, item)));
    };
    return nearest_boxes(world.num_boxes + static_cast<int>(inserted_.size()), box_at, is_present, origin, group);
  }

  Span<const int32_t> hidden_;
  Span<const InsertedBox> inserted_;
  bool leaves_gaps_ = false;
};

/// Clears the counts of sets that are not written.
PICTURA_HD inline void clear_other_counts(const ObservationView& out, int row) {
  int32_t* counts = out.set_counts.data() + static_cast<size_t>(row) * kNumEntitySets;
  for (int set = num_observed_sets(out); set < kNumEntitySets; ++set) counts[set] = 0;
}

/// Writes the observation of query i, which must be valid.
PICTURA_HD inline void answer_query(const WorldView& world, const ObservationQueries& asked, int i, bool entity_sets) {
  const ObservationQuery& query = asked.queries[i];
  const int agent = query.slot - world.first_slot;
  const QueriedObservation observation(asked, query);
  observe_own(world, agent, i, asked.out);
  if (!entity_sets) return;
  const NearPlace place = near_place(world, query.slot);
  for (int k = 0; k < num_observed_sets(asked.out); ++k) {
    const auto set = static_cast<EntitySet>(k);
    observe_set(world, agent, place, set, set_rows(asked.out, i, set), observation);
  }
  clear_other_counts(asked.out, i);
}

/// Kind of error of a query. query_fault() encodes kind, query and wrong value in one 64-bit word, which a host can
/// read atomically.
enum class QueryFault : int32_t {
  slot,
  hidden_begin,
  hidden_end,
  hidden_box,
  inserted_begin,
  inserted_end,
  inserted_box
};
constexpr int64_t kNoQueryFault = -1;
constexpr int kMaxQueries = 1 << 24;  // per call
PICTURA_HD constexpr int64_t query_fault(QueryFault what, int32_t query, int32_t value) {
  return (int64_t{static_cast<int32_t>(what)} << 56) | (int64_t{query} << 32) | static_cast<uint32_t>(value);
}

/// Whether all observed values are finite.
PICTURA_HD inline bool is_valid(const InsertedBox& one) {
  const AgentBox& box = one.box;
  return is_finite(box.center_m) && is_finite(box.cos_heading) && is_finite(box.sin_heading) &&
         is_finite(box.length_m) && is_finite(box.width_m) && is_finite(box.height_m) && is_finite(one.speed_mps);
}

/// Returns the error of query i, or kNoQueryFault. world_of(slot) must return the slot's WorldView.
template <typename WorldOf>
PICTURA_HD int64_t find_query_fault(const ObservationQueries& asked, int i, int num_slots, const WorldOf& world_of) {
  const ObservationQuery& query = asked.queries[i];
  const auto fault = [i](QueryFault what, int32_t value) { return query_fault(what, i, value); };
  if (query.slot < 0 || query.slot >= num_slots) return fault(QueryFault::slot, query.slot);
  const auto is_between = [](int32_t value, int32_t low, size_t high) {
    return value >= low && static_cast<size_t>(value) <= high;
  };
  const size_t num_hidden = asked.hidden.size(), num_inserted = asked.inserted.size();
  const int32_t hidden_begin = query.hidden_begin, inserted_begin = query.inserted_begin;
  if (!is_between(hidden_begin, 0, num_hidden)) return fault(QueryFault::hidden_begin, hidden_begin);
  if (!is_between(query.hidden_end, hidden_begin, num_hidden)) return fault(QueryFault::hidden_end, query.hidden_end);
  if (!is_between(inserted_begin, 0, num_inserted)) return fault(QueryFault::inserted_begin, inserted_begin);
  if (!is_between(query.inserted_end, inserted_begin, num_inserted)) {
    return fault(QueryFault::inserted_end, query.inserted_end);
  }
  const WorldView world = world_of(query.slot);
  for (int32_t k = hidden_begin; k < query.hidden_end; ++k) {
    const int32_t box = asked.hidden[k];
    if (box < world.first_box || box - world.first_box >= world.num_boxes) return fault(QueryFault::hidden_box, box);
  }
  for (int32_t k = inserted_begin; k < query.inserted_end; ++k) {
    if (!is_valid(asked.inserted[k])) return fault(QueryFault::inserted_box, k);
  }
  return kNoQueryFault;
}

}  // namespace pictura
