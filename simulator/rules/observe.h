// Observations of an agent in its ego frame, scaled to about [-1, 1] (docs/reference/observation.md).
#pragma once

#include "pictura/common/portable/async_copy.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/rules/ego_frame.h"
#include "pictura/simulator/rules/fast/observed_rows.h"
#include "pictura/simulator/rules/fast/pieces_in_sight.h"
#include "pictura/simulator/rules/step.h"

namespace pictura {

PICTURA_HD inline EgoFrame ego_frame(const AgentStateView& agents, int slot) {
  return {{agents.x_m[slot], agents.y_m[slot], agents.z_m[slot]}, {agents.cos_heading[slot], agents.sin_heading[slot]}};
}

PICTURA_HD inline void observe_ego(const WorldView& world, int slot, float* out) {
  const AgentStateView& agents = world.agents;
  out[0] = agents.speed_mps[slot] * per(kScaleSpeed_mps);
  out[1] = agents.length_m[slot] * per(kScaleLength_m);
  out[2] = agents.width_m[slot] * per(kScaleWidth_m);
  out[3] = agents.steer_rad[slot] * per(kScaleSteer_rad);
  out[4] = agents.accel_long_mps2[slot] * per(kScaleAccelLong_mps2);
  out[5] = agents.accel_lat_mps2[slot] * per(kScaleAccelLat_mps2);
  out[6] = agents.speed_limit_mps[slot] * per(kScaleSpeed_mps);
  const bool auxiliary = world.options.auxiliary_observations;
  out[7] = auxiliary ? agents.lane_offset_m[slot] * per(kNoLaneOffset_m) : 0.0f;
  out[8] = auxiliary && agents.lane[slot] >= 0 ? cos_of(agents.lane_angle_rad[slot]) : 0.0f;
}

/// Scales conditioning by the paper's training ranges, so that all runs observe equal coefficients equally.
/// Coefficients that the paper does not vary are observed as 0. Coefficients below the range, such as those of
/// pedestrians, are observed as -2 or more.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void observe_conditioning(const WorldView& world, int slot, float* out, const ThreadGroup& group = {}) {
  for (int i = group.rank(); i < kNumConditioning; i += group.size()) {
    const ConditioningRange range = world.options.conditioning_scale[i];
    const float value = world.agents.conditioning[slot * kNumConditioning + i];
    out[i] = range.high > range.low
                 ? clamp(2.0f * (value - range.low) / (range.high - range.low) - 1.0f, kMinConditioning, 1.0f)
                 : 0.0f;
  }
}

/// Writes the active waypoint and those after it. The last waypoint fills the remaining rows.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void observe_waypoints(const WorldView& world, int slot, const EgoFrame& frame, float* out,
                                  const ThreadGroup& group = {}) {
  for (int i = group.rank(); i < kNumWaypoints; i += group.size()) {
    const int index = min_of(world.agents.next_waypoint[slot] + i, kNumWaypoints - 1);
    const Vec3 local = frame.to_local(waypoint_of(world.agents, slot, index));
    out[kWaypointFeatures * i] = local.x * per(kScalePosition_m);
    out[kWaypointFeatures * i + 1] = local.y * per(kScalePosition_m);
    out[kWaypointFeatures * i + 2] = local.z * per(kScaleHeight_m);
  }
}

/// Finds the partners of `agent`: the other boxes whose centres are nearest to its reference point. Without enough
/// boxes in near cells, it searches up to kPartnerRange_m; in a world with many boxes, it doubles the radius instead.
template <typename ThreadGroup>
PICTURA_HD auto nearest_partners(const WorldView& world, int agent, Vec2 origin, const ThreadGroup& group) {
  using Nearest = typename ThreadGroup::template Nearest<kMaxPartners>;
  const GridView& cells = world.box_cells;
  constexpr int32_t kFew = 256;  // up to this number, reading all boxes is faster
  const bool is_crowd = cells.begin[cells.begin.size() - 1] > kFew;
  // A cell may be wider than the visible range, for instance on a GPU.
  for (float reach = min_of(cells.cell_m, kPartnerRange_m);;
       reach = is_crowd ? min_of(2.0f * reach, kPartnerRange_m) : kPartnerRange_m) {
    const CellRows range = cells_around(cells, origin, reach);
    const bool is_near = reach < kPartnerRange_m;
    int found = 0;
    for (int y = range.y0; y <= range.y1 && is_near; ++y) found += range.end(cells, y) - range.begin(cells, y);
    // Usually at most half of these boxes are within reach.
    if (is_near && found < 2 * kMaxPartners) continue;
    Nearest nearest;
    if constexpr (ThreadGroup::kSize == 1) {
      // Boxes of consecutive rows are contiguous. If they are few, one loop over all is faster.
      const bool at_once = range.end(cells, range.y1) - range.begin(cells, range.y0) <= kFew;
      for (int y = range.y0; y <= range.y1; ++y) {
        const int32_t begin = range.begin(cells, y);
        if (at_once) y = range.y1;
        nearest.offer_all(world.cell_centers + begin, cells.items.data() + begin, range.end(cells, y) - begin, agent,
                          origin, square(reach));
      }
    } else {
      for (int y = range.y0; y <= range.y1; ++y) {
        const int32_t begin = range.begin(cells, y), end = range.end(cells, y);
        constexpr int kAtOnce = 4;  // loads in flight
        for (int32_t first = begin + group.rank(); first - group.rank() < end; first += kAtOnce * group.size()) {
          int32_t others[kAtOnce];
          Vec2 centers[kAtOnce];
          for (int k = 0; k < kAtOnce; ++k) {
            const int32_t i = min_of(first + k * group.size(), end - 1);
            others[k] = cells.items[i];
            centers[k] = world.cell_centers[i];
          }
          for (int k = 0; k < kAtOnce; ++k) {
            const Vec2 apart = centers[k] - origin;
            const float d2 = dot(apart, apart);
            const bool is_one = first + k * group.size() < end && others[k] != agent && d2 < square(reach);
            nearest.add(is_one, d2, others[k]);
          }
        }
      }
    }
    nearest.settle();
    if (!is_near || nearest.count() == kMaxPartners) return nearest;
  }
}

/// Finds the nearest drawn boxes among box_at(i), i < num_boxes, with is_present(i).
template <typename ThreadGroup, typename BoxAt, typename IsPresent>
PICTURA_HD auto nearest_boxes(int num_boxes, const BoxAt& box_at, const IsPresent& is_present, Vec2 origin,
                              const ThreadGroup& group) {
  typename ThreadGroup::template Nearest<kMaxPartners> nearest;
  for (int first = 0; first < num_boxes; first += group.size()) {
    const int i = min_of(first + group.rank(), num_boxes - 1);
    const AgentBox& box = box_at(i);
    const Vec2 apart = box.center_m.xy() - origin;
    const float d2 = dot(apart, apart);
    nearest.add(first + group.rank() < num_boxes && box.drawn && is_present(i) && d2 < square(kPartnerRange_m), d2, i);
  }
  nearest.settle();
  return nearest;
}

/// 0 for parked cars.
PICTURA_HD inline float observed_speed_mps(const WorldView& world, int box) {
  if (!world.options.auxiliary_observations) return 0.0f;
  if (box < world.num_agents) return world.agents.speed_mps[world.first_slot + box];
  if (!has_replayed_tracks(world.map)) return 0.0f;
  return replayed_state(world.map, box - world.num_agents, world.step).speed_mps;
}

template <typename ThreadGroup = SingleThread>
PICTURA_HD int observe_partners(const WorldView& world, int agent, const EgoFrame& frame, float* rows,
                                const ThreadGroup& group = {}) {
  const auto nearest = nearest_partners(world, agent, frame.origin_m.xy(), group);
  const int count = nearest.count();
  const RowFrame row_frame(frame);
  for (int i = group.rank(); i < count; i += group.size()) {
    const int other = nearest.item(i);
    write_partner(world.boxes[other], observed_speed_mps(world, other), row_frame, rows + i * kPartnerFeatures);
  }
  return count;
}

/// Pieces of one kind, and indices of those that may be visible.
struct PieceList {
  Span<const ObservedPiece> pieces;
  Span<const Vec2> middles;
  Span<const int32_t> items;
};

/// Writes the first `capacity` visible pieces.
PICTURA_HD inline int observe_pieces(const PieceList& near, const EgoFrame& frame, int capacity, float* out) {
  constexpr int kMaxPieces = max_of(max_of(kMaxLanes, kMaxBoundaries), kMaxWalls);
  int32_t found[kMaxPieces + kFoundBeyond];
  const int count = min_of(capacity, find_pieces_in_sight(near.middles, near.items, frame, capacity, found));
  write_pieces(near.pieces, found, count, capacity, RowFrame(frame), out);
  return count;
}

/// Integer arithmetic avoids branches, which are hard to predict because lights differ.
PICTURA_HD constexpr float light_code(LightState state) {
  const int halves = 2 * (state == LightState::red) + (state == LightState::yellow) - 2 * (state == LightState::green);
  return 0.5f * static_cast<float>(halves);
}

/// Writes the nearest stop lines. `items` must come from items_near().
template <typename ThreadGroup = SingleThread>
PICTURA_HD int observe_controls(const WorldView& world, int slot, Span<const int32_t> items, const EgoFrame& frame,
                                float* rows, const ThreadGroup& group = {}) {
  const int num_items = static_cast<int>(items.size());
  typename ThreadGroup::template Nearest<kMaxControls> nearest;
  for (int first = 0; first < num_items; first += group.size()) {
    const int i = first + group.rank();
    const int32_t light = items[min_of(i, num_items - 1)];
    const Vec2 apart = world.map.stop_lines[light].middle_m.xy() - frame.origin_m.xy();
    const float d2 = dot(apart, apart);
    nearest.add(i < num_items && d2 < square(kControlRange_m), d2, light);
  }
  nearest.settle();
  const int32_t lane = world.agents.lane[slot];
  const int32_t own_light = lane < 0 ? -1 : world.map.lanes[lane].light;
  const int count = nearest.count();
  const RowFrame ends_frame = RowFrame::of_two_places(frame);
  for (int i = group.rank(); i < count; i += group.size()) {
    float* out = rows + i * kControlFeatures;
    const int32_t light = nearest.item(i);
    const LocalEnds ends = ends_of(world.map.stop_lines[light], ends_frame);
    out[0] = ends.left_m.x * per(kScalePosition_m);
    out[1] = ends.left_m.y * per(kScalePosition_m);
    out[2] = ends.right_m.x * per(kScalePosition_m);
    out[3] = ends.right_m.y * per(kScalePosition_m);
    out[4] = 0.5f * (ends.left_m.z + ends.right_m.z) * per(kScaleHeight_m);
    out[5] = light_code(world.lights[light]);
    out[6] = light == own_light ? 1.0f : 0.0f;
  }
  return count;
}

/// Whether the observation can be used: the agent takes actions, or its episode or life ended in this step.
PICTURA_HD inline bool observes(const WorldView& world, int agent) {
  return takes_actions(world, agent) || has_left(world, agent) ||
         (world.agents.events[world.first_slot + agent] & kInfractions) != 0;
}

/// Whether the entity set may be nonempty. `hidden` must be the result of hidden_from().
PICTURA_HD inline bool observes_set(const WorldView& world, int agent, EntitySet set, Hides hidden) {
  const bool is_hidden =
      (set == EntitySet::partners && hidden == kHidesAgents) || (set == EntitySet::controls && hidden == kHidesLights);
  return !is_hidden && observes(world, agent);
}

/// Writes the arrays of part `own`: zeros for absent agents and for agents that halted in an earlier step.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void observe_own(const WorldView& world, int agent, int row, const ObservationView& out,
                            const ThreadGroup& group = {}) {
  const int slot = world.first_slot + agent;
  const size_t at = static_cast<size_t>(row);
  float* ego = out.ego.data() + at * kEgoFeatures;
  float* conditioning = out.conditioning.data() + at * kNumConditioning;
  float* waypoints = out.waypoints.data() + at * kNumWaypoints * kWaypointFeatures;
  if (observes(world, agent)) {
    if (group.rank() == 0) observe_ego(world, slot, ego);
    observe_conditioning(world, slot, conditioning, group);
    observe_waypoints(world, slot, ego_frame(world.agents, slot), waypoints, group);
    return;
  }
  for (int i = group.rank(); i < kEgoFeatures; i += group.size()) ego[i] = 0.0f;
  for (int i = group.rank(); i < kNumConditioning; i += group.size()) conditioning[i] = 0.0f;
  for (int i = group.rank(); i < kNumWaypoints * kWaypointFeatures; i += group.size()) waypoints[i] = 0.0f;
}

/// All sets, or all except walls.
PICTURA_HD inline int num_observed_sets(const ObservationView& out) {
  return out.walls.empty() ? static_cast<int>(EntitySet::walls) : kNumEntitySets;
}

/// Destination of an entity set.
struct SetRows {
  float* rows = nullptr;
  int features = 0, capacity = 0;
  int32_t* count = nullptr;
};

PICTURA_HD inline SetRows set_rows(const ObservationView& out, int observation, EntitySet set) {
  const size_t row = static_cast<size_t>(observation);
  int32_t* count = out.set_counts.data() + row * kNumEntitySets + static_cast<int>(set);
  switch (set) {
    case EntitySet::partners:
      return {out.partners.data() + row * kMaxPartners * kPartnerFeatures, kPartnerFeatures, kMaxPartners, count};
    case EntitySet::lanes: return {out.lanes.data() + row * kMaxLanes * kLaneFeatures, kLaneFeatures, kMaxLanes, count};
    case EntitySet::boundaries:
      return {out.boundaries.data() + row * kMaxBoundaries * kBoundaryFeatures, kBoundaryFeatures, kMaxBoundaries,
              count};
    case EntitySet::walls: return {out.walls.data() + row * kMaxWalls * kWallFeatures, kWallFeatures, kMaxWalls, count};
    default:
      return {out.controls.data() + row * kMaxControls * kControlFeatures, kControlFeatures, kMaxControls, count};
  }
}

PICTURA_HD inline NearPlace near_place(const WorldView& world, int slot) {
  const AgentStateView& agents = world.agents;
  return near_place(world.map, {agents.x_m[slot], agents.y_m[slot]}, agents.heading_rad[slot]);
}

/// Lists of the pieces or stop lines of a set, for all places.
PICTURA_HD inline const GridView& lists_near(const MapView& map, EntitySet set) {
  switch (set) {
    case EntitySet::lanes: return map.near_lane_pieces;
    case EntitySet::walls: return map.near_wall_pieces;
    case EntitySet::controls: return map.near_stop_lines;
    default: return map.near_boundary_pieces;
  }
}

/// Index of a place's list in lists_near().
PICTURA_HD inline uint32_t list_index(NearPlace place, EntitySet set) {
  return set == EntitySet::controls ? place.cell() : place.cell_and_sector;
}

/// Returns the pieces or stop lines of a set that are near a place.
PICTURA_HD inline Span<const int32_t> items_near(const MapView& map, NearPlace place, EntitySet set) {
  return list_of(lists_near(map, set), list_index(place, set));
}

/// `items` must come from items_near().
PICTURA_HD inline PieceList piece_list(const MapView& map, EntitySet set, Span<const int32_t> items) {
  switch (set) {
    case EntitySet::lanes: return {map.lane_pieces, map.lane_middles, items};
    case EntitySet::walls: return {map.wall_pieces, map.wall_middles, items};
    default: return {map.boundary_pieces, map.boundary_middles, items};
  }
}

/// Prefetches the list of items_near(), because all lists together exceed a core's caches.
PICTURA_HD inline void prefetch_list_near(const MapView& map, NearPlace place, EntitySet set) {
  constexpr int kLines = 5, kLineBytes = 64;  // enough for most lists
  if (set == EntitySet::partners || set == EntitySet::controls) return;
  const int32_t* items = items_near(map, place, set).data();
  for (int line = 0; line < kLines; ++line) prefetch(items, line * kLineBytes);
}

/// Argument of observe_set() for a step. The destination contains the previous step's rows.
struct StepObservation {
  /// Number of rows that may be nonzero; clamped, because callers may have changed the count.
  PICTURA_HD static int num_filled(const SetRows& set) { return min_of(max_of(*set.count, 0), set.capacity); }
  template <typename ThreadGroup>
  PICTURA_HD static int observe_partners(const WorldView& world, int agent, const EgoFrame& frame, float* rows,
                                         const ThreadGroup& group) {
    return pictura::observe_partners(world, agent, frame, rows, group);
  }
};

/// Writes one entity set. It is empty if it is hidden, or if the agent is absent or was halted in an earlier step.
template <typename Observation>
PICTURA_HD void observe_set(const WorldView& world, int agent, NearPlace place, EntitySet set, const SetRows& out,
                            const Observation& observation) {
  const int slot = world.first_slot + agent;
  int count = 0;
  if (observes_set(world, agent, set, hidden_from(world, agent))) {
    const EgoFrame frame = ego_frame(world.agents, slot);
    if (set == EntitySet::partners) {
      count = observation.observe_partners(world, agent, frame, out.rows, SingleThread{});
    } else if (set == EntitySet::controls) {
      count = observe_controls(world, slot, items_near(world.map, place, set), frame, out.rows);
    } else {
      const PieceList near = piece_list(world.map, set, items_near(world.map, place, set));
      count = observe_pieces(near, frame, out.capacity, out.rows);
    }
  }
  const int end = observation.num_filled(out) * out.features;
  for (int i = count * out.features; i < end; ++i) out.rows[i] = 0.0f;
  *out.count = count;
}

/// Writes the observations of agents [begin, end). Each block of agents writes one kind of set after another, so that
/// map data stay in the cache.
PICTURA_HD inline void observe(const WorldView& world, int begin, int end, bool entity_sets,
                               const ObservationView& out) {
  for (int agent = begin; agent < end; ++agent) observe_own(world, agent, world.first_slot + agent, out);
  if (!entity_sets) return;
  constexpr int kBlock = 128, kAhead = 2;  // agents per block; prefetch distance in agents
  NearPlace places[kBlock];
  for (int first = begin; first < end; first += kBlock) {
    const int count = min_of(kBlock, end - first);
    for (int i = 0; i < count; ++i) places[i] = near_place(world, world.first_slot + first + i);
    for (int s = 0; s < num_observed_sets(out); ++s) {
      const auto set = static_cast<EntitySet>(s);
      for (int i = 0; i < count; ++i) {
        prefetch_list_near(world.map, places[min_of(i + kAhead, count - 1)], set);
        const int slot = world.first_slot + first + i;
        observe_set(world, first + i, places[i], set, set_rows(out, slot, set), StepObservation{});
      }
    }
  }
}

}  // namespace pictura
