// What an agent observes, in its own frame (x forward, y left, at the reference point) and scaled to about [-1, 1].
// docs/observation.md is the table of slots, units and scales; the constants here are its source.
#pragma once

#include "pictura/common/portable/async_copy.h"
#include "pictura/common/portable/float8.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/rules/step.h"

namespace pictura {

// What a value of 1 means.
constexpr float kScalePosition_m = 120.0f, kScaleHeight_m = 10.0f, kScaleSpeed_mps = 20.0f;
constexpr float kScaleLength_m = 6.0f, kScaleWidth_m = 3.0f, kScaleHalfPiece_m = 5.0f, kScaleLaneWidth_m = 5.0f;
constexpr float kScaleWallHeight_m = 12.0f;
constexpr float kMinConditioning = -2.0f;  // no observed coefficient is lower
constexpr float kScaleSteer_rad = 0.55f, kScaleAccelLong_mps2 = 5.0f, kScaleAccelLat_mps2 = 4.0f;

/// What to multiply by: every observation scales by a constant, and dividing would take ten times as long.
PICTURA_HD constexpr float per(float scale) { return 1.0f / scale; }

// What is in sight.
constexpr float kPartnerRange_m = 100.0f, kControlRange_m = 100.0f;
constexpr float kRoadAhead_m = 120.0f, kRoadBehind_m = 20.0f, kRoadAside_m = 30.0f;

/// The ego frame.
struct EgoFrame {
  Vec3 origin_m;
  Vec2 forward;

  PICTURA_HD Vec2 turn(Vec2 v) const { return {dot(v, forward), cross(forward, v)}; }
  PICTURA_HD Vec3 to_local(Vec3 p) const {
    const Vec2 xy = turn(p.xy() - origin_m.xy());
    return {xy.x, xy.y, p.z - origin_m.z};
  }
};

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

/// Scaled by the paper's training ranges, whatever the run's own are, so that a policy reads the same number for the
/// same coefficient everywhere; fixed coefficients read 0. Values below the range, as pedestrians have them, are told
/// apart down to -2.
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

/// The active waypoint first, then those after it; where the chain has no more, its last one again.
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

/// The ego frame for eight floats that hold a place (0, 1, 2) and a direction (4, 5), or two places.
struct RowFrame {
  Float8 minus_origin, cos, sin;

  PICTURA_HD explicit RowFrame(const EgoFrame& frame) : RowFrame(frame, {}) {}
  PICTURA_HD static RowFrame of_two_places(const EgoFrame& frame) { return {frame, frame.origin_m}; }

  /// EgoFrame::to_local() of the place and turn() of the direction.
  PICTURA_HD Float8 to_local(const Float8& row) const {
    const Float8 moved = row + minus_origin;
    return blend<0b00110011>(moved, moved * cos + swap_pairs(moved) * sin);
  }

 private:
  // x + -0 is x, also where x is -0.
  PICTURA_HD RowFrame(const EgoFrame& frame, Vec3 second_origin_m)
      : minus_origin(set8(-frame.origin_m.x, -frame.origin_m.y, -frame.origin_m.z, -0.0f, -second_origin_m.x,
                          -second_origin_m.y, -second_origin_m.z, -0.0f)),
        cos(set8(frame.forward.x, frame.forward.x, 0, 0, frame.forward.x, frame.forward.x, 0, 0)),
        sin(set8(frame.forward.y, -frame.forward.y, 0, 0, frame.forward.y, -frame.forward.y, 0, 0)) {}
};

#ifdef offsetof  // NVRTC has none
// What is read as eight floats.
static_assert(offsetof(AgentBox, cos_heading) == 3 * sizeof(float) &&
              offsetof(AgentBox, height_m) == 7 * sizeof(float));
static_assert(offsetof(StopLine, right_m) == 3 * sizeof(float) && sizeof(StopLine) >= 8 * sizeof(float));
#endif

/// The row of a partner, but for the last feature.
PICTURA_HD inline Float8 observe_box(const AgentBox& box, const RowFrame& frame) {
  // x, y, z, length, cos, sin, width, height
  const Float8 turnable = permute<0, 1, 2, 5, 3, 4, 6, 7>(load8(&box.center_m.x));
  const Float8 scaled =
      frame.to_local(turnable) * set8(per(kScalePosition_m), per(kScalePosition_m), per(kScaleHeight_m),
                                      per(kScaleLength_m), 1, 1, per(kScaleWidth_m), 1);
  return permute<0, 1, 2, 3, 6, 4, 5, 7>(scaled);
}

/// The partners of `agent` by distance from its reference point to their box centres: from the near cells where enough
/// stand there, else from all that are in range.
template <typename ThreadGroup>
PICTURA_HD auto nearest_partners(const WorldView& world, int agent, Vec2 origin, const ThreadGroup& group) {
  using Nearest = typename ThreadGroup::template Nearest<kMaxPartners>;
  const GridView& cells = world.box_cells;
  // A cell may be wider than what is in sight: a device has but one.
  for (float reach = min_of(cells.cell_m, kPartnerRange_m);; reach = kPartnerRange_m) {
    const CellRows range = cells_around(cells, origin, reach);
    const bool is_near = reach < kPartnerRange_m;
    int found = 0;
    for (int y = range.y0; y <= range.y1 && is_near; ++y) found += range.end(cells, y) - range.begin(cells, y);
    if (is_near && found <= kMaxPartners) continue;
    Nearest nearest;
    if constexpr (ThreadGroup::kSize == 1) {
      // Rows follow one another: what stands beside the range is read as well, which costs less than a loop a row.
      const int32_t begin = range.begin(cells, range.y0), end = range.end(cells, range.y1);
      nearest.offer_all(world.cell_centers + begin, cells.items.data() + begin, end - begin, agent, origin,
                        square(reach));
    } else {
      for (int y = range.y0; y <= range.y1; ++y) {
        const int32_t begin = range.begin(cells, y), end = range.end(cells, y);
        constexpr int kAtOnce = 4;  // whose loads are under way together
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
            const float d2 = length2(apart.x, apart.y);
            const bool is_one = first + k * group.size() < end && others[k] != agent && d2 < square(reach);
            nearest.offer(is_one, d2, others[k]);
          }
        }
      }
    }
    nearest.settle();
    if (!is_near || nearest.count() == kMaxPartners) return nearest;
  }
}

/// As nearest_partners(), of any boxes one after the other: box_at(i) is one of num_boxes, and counts where
/// is_there(i).
template <typename ThreadGroup, typename BoxAt, typename IsThere>
PICTURA_HD auto nearest_boxes(int num_boxes, const BoxAt& box_at, const IsThere& is_there, Vec2 origin,
                              const ThreadGroup& group) {
  typename ThreadGroup::template Nearest<kMaxPartners> nearest;
  for (int first = 0; first < num_boxes; first += group.size()) {
    const int i = min_of(first + group.rank(), num_boxes - 1);
    const AgentBox& box = box_at(i);
    const Vec2 apart = box.center_m.xy() - origin;
    const float d2 = length2(apart.x, apart.y);
    nearest.offer(first + group.rank() < num_boxes && box.drawn && is_there(i) && d2 < square(kPartnerRange_m), d2, i);
  }
  nearest.settle();
  return nearest;
}

/// The speed of a world's box as others observe it: parked cars have none.
PICTURA_HD inline float observed_speed_mps(const WorldView& world, int box) {
  const bool moves = world.options.auxiliary_observations && box < world.num_agents;
  return moves ? world.agents.speed_mps[world.first_slot + box] : 0.0f;
}

PICTURA_HD inline void observe_partner(const AgentBox& box, float speed_mps, const RowFrame& frame, float* out) {
  store8(observe_box(box, frame), out);
  out[7] = speed_mps * per(kScaleSpeed_mps);
}

template <typename ThreadGroup = SingleThread>
PICTURA_HD int observe_partners(const WorldView& world, int agent, const EgoFrame& frame, float* rows,
                                const ThreadGroup& group = {}) {
  const auto nearest = nearest_partners(world, agent, frame.origin_m.xy(), group);
  const int count = nearest.count();
  const RowFrame row_frame(frame);
  for (int i = group.rank(); i < count; i += group.size()) {
    const int other = nearest.item(i);
    observe_partner(world.boxes[other], observed_speed_mps(world, other), row_frame, rows + i * kPartnerFeatures);
  }
  return count;
}

/// Whether the middles of pieces are in sight, of one or of eight: a bit each.
template <typename Number>
PICTURA_HD uint32_t in_sight(Number x_m, Number y_m, Number minus_origin_x_m, Number minus_origin_y_m, Number cos,
                             Number sin, Number middle_m, Number half_m, Number aside_m) {
  const Number from_ego_x = x_m + minus_origin_x_m, from_ego_y = y_m + minus_origin_y_m;
  const Number ahead = from_ego_x * cos + from_ego_y * sin, left = cos * from_ego_y - sin * from_ego_x;
  return at_most(magnitude(ahead - middle_m), half_m) & at_most(magnitude(left), aside_m);
}
constexpr float kRoadMiddle_m = 0.5f * (kRoadAhead_m - kRoadBehind_m);
constexpr float kRoadHalf_m = 0.5f * (kRoadAhead_m + kRoadBehind_m);

PICTURA_HD inline bool is_in_sight(const ObservedPiece& piece, const EgoFrame& frame) {
  return in_sight(piece.middle_m.x, piece.middle_m.y, -frame.origin_m.x, -frame.origin_m.y, frame.forward.x,
                  frame.forward.y, kRoadMiddle_m, kRoadHalf_m, kRoadAside_m) != 0;
}

/// The row of a piece, and a zero behind it.
PICTURA_HD inline Float8 observe_piece(const ObservedPiece& piece, const RowFrame& frame) {
  return frame.to_local(load8(&piece.middle_m.x)) *
         set8(per(kScalePosition_m), per(kScalePosition_m), per(kScaleHeight_m), per(kScaleHalfPiece_m), 1, 1, 1, 1);
}

/// The pieces of a map that a set of them shows, and which of them can be seen from where the agent is.
struct PieceList {
  Span<const ObservedPiece> pieces;
  Span<const Vec2> middles;
  Span<const int32_t> items;
};

/// Which of the pieces listed are in sight: the first of them, at least `capacity` if there are so many.
PICTURA_HD inline int find_pieces_in_sight(Span<const Vec2> middles, Span<const int32_t> items, const EgoFrame& frame,
                                           int capacity, int32_t* found_out) {
  const Float8 minus_origin_x = fill8(-frame.origin_m.x), minus_origin_y = fill8(-frame.origin_m.y);
  const Float8 cos = fill8(frame.forward.x), sin = fill8(frame.forward.y);
  const int num_items = static_cast<int>(items.size());
  int count = 0;
  const auto look_at = [&](const int32_t* eight, uint32_t these) {
    Float8 x, y;
    gather_pairs(&middles.data()->x, eight, &x, &y);
    const uint32_t seen = these & in_sight(x, y, minus_origin_x, minus_origin_y, cos, sin, fill8(kRoadMiddle_m),
                                           fill8(kRoadHalf_m), fill8(kRoadAside_m));
    copy_chosen(eight, seen, found_out + count);
    count += popcount(seen);
  };
  int i = 0;
  for (; i + 8 <= num_items && count < capacity; i += 8) look_at(items.data() + i, 0xFF);
  const int left = num_items - i;
  if (left > 0 && count < capacity) {
    if (num_items >= 8) {
      look_at(items.data() + num_items - 8, last_of_eight(left));
    } else {
      int32_t few[8];
      for (int k = 0; k < 8; ++k) few[k] = items[min_of(k, left - 1)];
      look_at(few, first_of_eight(left));
    }
  }
  return count;
}

/// Lanes, boundaries or walls: of the pieces listed for the ego's cell, the first `capacity` whose middles are in
/// sight.
PICTURA_HD inline int observe_pieces(const PieceList& near, const EgoFrame& frame, int capacity, float* out) {
  constexpr int kMaxPieces = max_of(max_of(kMaxLanes, kMaxBoundaries), kMaxWalls);
  int32_t found[kMaxPieces + 8];
  const int count = min_of(capacity, find_pieces_in_sight(near.middles, near.items, frame, capacity, found));
  const RowFrame row_frame(frame);
  const auto row_of = [&](int i) { return observe_piece(near.pieces[found[i]], row_frame); };
  // The zero behind a row lies where the next one begins; only the set's last row has none behind it.
  const int num_followed = min_of(count, capacity - 1);
  for (int i = 0; i < num_followed; ++i, out += kLaneFeatures) store8(row_of(i), out);
  if (num_followed < count) {
    float row[8];
    store8(row_of(num_followed), row);
    for (int f = 0; f < kLaneFeatures; ++f) out[f] = row[f];
  }
  return count;
}
static_assert(kLaneFeatures == kBoundaryFeatures && kLaneFeatures == kWallFeatures);

/// Red 1, yellow 0.5, green -1, else 0; in integers, since compilers then need no branches, and the lights around an
/// agent differ.
PICTURA_HD constexpr float light_code(LightState state) {
  const int halves = 2 * (state == LightState::red) + (state == LightState::yellow) - 2 * (state == LightState::green);
  return 0.5f * static_cast<float>(halves);
}

/// The nearest stop lines: left and right end, height, state, and whether it holds the ego's lane.
template <typename ThreadGroup = SingleThread>
PICTURA_HD int observe_controls(const WorldView& world, int slot, const NearPlace& place, const EgoFrame& frame,
                                float* rows, const ThreadGroup& group = {}) {
  const Span<const int32_t> items = list_of(world.map.near_stop_lines, place.cell);
  const int num_items = static_cast<int>(items.size());
  typename ThreadGroup::template Nearest<kMaxControls> nearest;
  for (int first = 0; first < num_items; first += group.size()) {
    const int i = first + group.rank();
    const int32_t light = items[min_of(i, num_items - 1)];
    const Vec2 apart = world.map.stop_lines[light].middle_m.xy() - frame.origin_m.xy();
    const float d2 = length2(apart.x, apart.y);
    nearest.offer(i < num_items && d2 < square(kControlRange_m), d2, light);
  }
  nearest.settle();
  const int32_t lane = world.agents.lane[slot];
  const int32_t own_light = lane < 0 ? -1 : world.map.lanes[lane].light;
  const int count = nearest.count();
  const RowFrame ends_frame = RowFrame::of_two_places(frame);
  for (int i = group.rank(); i < count; i += group.size()) {
    float* out = rows + i * kControlFeatures;
    const int32_t light = nearest.item(i);
    const StopLine& line = world.map.stop_lines[light];
    const Float8 ends = permute<0, 1, 2, 6, 3, 4, 5, 7>(load8(&line.left_m.x));  // left, right
    float local[8];
    store8(ends_frame.to_local(ends), local);
    out[0] = local[0] * per(kScalePosition_m);
    out[1] = local[1] * per(kScalePosition_m);
    out[2] = local[4] * per(kScalePosition_m);
    out[3] = local[5] * per(kScalePosition_m);
    out[4] = 0.5f * (local[2] + local[6]) * per(kScaleHeight_m);
    out[5] = light_code(world.lights[light]);
    out[6] = light == own_light ? 1.0f : 0.0f;
  }
  return count;
}

/// Whether anybody learns from or acts on the agent's observation: it drives or may begin to, or this is its last one.
PICTURA_HD inline bool observes(const WorldView& world, int agent) {
  return takes_actions(world, agent) || has_left(world, agent) ||
         (world.agents.events[world.first_slot + agent] & kInfractions) != 0;
}

/// What is no set, to that row of `out`: all zeros for the absent and for those that halted in an earlier step.
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

/// How many sets are written: all, or all but the walls.
PICTURA_HD inline int num_observed_sets(const ObservationView& out) {
  return out.walls.empty() ? static_cast<int>(EntitySet::walls) : kNumEntitySets;
}

/// Where a set of one observation is written.
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

PICTURA_HD inline PieceList pieces_near(const MapView& map, const NearPlace& place, EntitySet set) {
  switch (set) {
    case EntitySet::lanes:
      return {map.lane_pieces, map.lane_middles, list_of(map.near_lane_pieces, place.cell_and_sector())};
    case EntitySet::walls:
      return {map.wall_pieces, map.wall_middles, list_of(map.near_wall_pieces, place.cell_and_sector())};
    default:
      return {map.boundary_pieces, map.boundary_middles, list_of(map.near_boundary_pieces, place.cell_and_sector())};
  }
}

/// Begins to load what pieces_near() lists: the lists of all places do not fit into a core's caches.
PICTURA_HD inline void prefetch_list_near(const MapView& map, const NearPlace& place, EntitySet set) {
  constexpr int kLines = 5, kLineBytes = 64;  // as many as most lists take
  if (set == EntitySet::partners || set == EntitySet::controls) return;
  const int32_t* items = pieces_near(map, place, set).items.data();
  for (int line = 0; line < kLines; ++line) prefetch(items, line * kLineBytes);
}

/// The observation that each step writes: of all who are there, over the one of the step before.
struct StepObservation {
  /// How many rows may hold more than zeros. The memory is lent to callers, who may have written anything to it.
  PICTURA_HD static int num_filled(const SetRows& set) { return min_of(max_of(*set.count, 0), set.capacity); }
  template <typename ThreadGroup>
  PICTURA_HD static int observe_partners(const WorldView& world, int agent, const EgoFrame& frame, float* rows,
                                         const ThreadGroup& group) {
    return pictura::observe_partners(world, agent, frame, rows, group);
  }
};

/// One entity set: empty for the absent and for those that halted in an earlier step.
template <typename Observation>
PICTURA_HD void observe_set(const WorldView& world, int agent, const NearPlace& place, EntitySet set,
                            const SetRows& out, const Observation& observation) {
  const int slot = world.first_slot + agent;
  int count = 0;
  if (observes(world, agent)) {
    const EgoFrame frame = ego_frame(world.agents, slot);
    if (set == EntitySet::partners) {
      count = observation.observe_partners(world, agent, frame, out.rows, SingleThread{});
    } else if (set == EntitySet::controls) {
      count = observe_controls(world, slot, place, frame, out.rows);
    } else {
      count = observe_pieces(pieces_near(world.map, place, set), frame, out.capacity, out.rows);
    }
  }
  const int end = observation.num_filled(out) * out.features;
  for (int i = count * out.features; i < end; ++i) out.rows[i] = 0.0f;
  *out.count = count;
}

/// Writes the whole observations of agents [begin, end) of a world; sets if `entity_sets`. Set by set, so that what one
/// kind is read from stays in the cache.
PICTURA_HD inline void observe(const WorldView& world, int begin, int end, bool entity_sets,
                               const ObservationView& out) {
  for (int agent = begin; agent < end; ++agent) observe_own(world, agent, world.first_slot + agent, out);
  if (!entity_sets) return;
  constexpr int kBlock = 128, kAhead = 2;  // agents whose places are kept, and how early a list is asked for
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
