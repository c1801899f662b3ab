// What an agent observes, in its own frame (x forward, y left, at the reference point) and scaled to about [-1, 1].
// docs/observation.md is the table of slots, units and scales; the constants here are its source.
#pragma once

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

/// The partners of `agent` by distance from its reference point to their box centres: from the near cells where enough
/// stand there, else from all that are in range.
template <typename ThreadGroup>
PICTURA_HD auto nearest_partners(const WorldView& world, int agent, Vec2 origin, const ThreadGroup& group) {
  using Nearest = typename ThreadGroup::template Nearest<kMaxPartners>;
  const GridView& cells = world.box_cells;
  for (float reach = cells.cell_m;; reach = kPartnerRange_m) {
    const CellRows range = cells_around(cells, origin, reach);
    const bool is_near = reach < kPartnerRange_m;
    int found = 0;
    for (int y = range.y0; y <= range.y1 && is_near; ++y) found += range.end(cells, y) - range.begin(cells, y);
    if (is_near && found <= kMaxPartners) continue;
    Nearest nearest;
    for (int y = range.y0; y <= range.y1; ++y) {
      const int32_t begin = range.begin(cells, y), end = range.end(cells, y);
      constexpr int kAtOnce = ThreadGroup::kSize > 1 ? 4 : 1;  // whose loads are under way together
      for (int32_t first = begin + group.rank(); first - group.rank() < end; first += kAtOnce * group.size()) {
        int32_t others[kAtOnce];
        Vec2 centers[kAtOnce];
        for (int k = 0; k < kAtOnce; ++k) {
          const int32_t i = min_of(first + k * group.size(), end - 1);
          others[k] = cells.items[static_cast<size_t>(i)];
          centers[k] = world.cell_centers[i];
        }
        for (int k = 0; k < kAtOnce; ++k) {
          const Vec2 apart = centers[k] - origin;
          const float d2 = dot(apart, apart);
          const bool is_one = first + k * group.size() < end && others[k] != agent && d2 < square(kPartnerRange_m);
          nearest.offer(is_one, d2, others[k]);
        }
      }
    }
    if (!is_near || (nearest.count() == kMaxPartners && nearest.worst() <= square(reach))) return nearest;
  }
}

template <typename ThreadGroup = SingleThread>
PICTURA_HD int observe_partners(const WorldView& world, int agent, const EgoFrame& frame, float* rows,
                                const ThreadGroup& group = {}) {
  const auto nearest = nearest_partners(world, agent, frame.origin_m.xy(), group);
  const int count = nearest.count();
  for (int i = group.rank(); i < count; i += group.size()) {
    float* out = rows + i * kPartnerFeatures;
    const int other = nearest.item(i);
    const AgentBox& box = world.boxes[other];
    const Vec3 local = frame.to_local(box.center_m);
    const Vec2 heading = frame.turn({box.cos_heading, box.sin_heading});
    const bool moves = world.options.auxiliary_observations && other < world.num_agents;
    out[0] = local.x * per(kScalePosition_m);
    out[1] = local.y * per(kScalePosition_m);
    out[2] = local.z * per(kScaleHeight_m);
    out[3] = box.length_m * per(kScaleLength_m);
    out[4] = box.width_m * per(kScaleWidth_m);
    out[5] = heading.x;
    out[6] = heading.y;
    out[7] = moves ? world.agents.speed_mps[world.first_slot + other] * per(kScaleSpeed_mps) : 0.0f;
  }
  return count;
}

/// Writes the row of a piece; returns whether its middle is in sight.
PICTURA_HD inline bool observe_piece(const ObservedPiece& piece, const EgoFrame& frame, float* row) {
  constexpr float kMiddle_m = 0.5f * (kRoadAhead_m - kRoadBehind_m), kHalf_m = 0.5f * (kRoadAhead_m + kRoadBehind_m);
  const Vec3 local = frame.to_local(piece.middle_m);
  const Vec2 direction = frame.turn(piece.direction);
  row[0] = local.x * per(kScalePosition_m);
  row[1] = local.y * per(kScalePosition_m);
  row[2] = local.z * per(kScaleHeight_m);
  row[3] = piece.half_length_m * per(kScaleHalfPiece_m);
  row[4] = direction.x;
  row[5] = direction.y;
  row[6] = piece.extent;
  return static_cast<int>(fabsf(local.x - kMiddle_m) <= kHalf_m) & static_cast<int>(fabsf(local.y) <= kRoadAside_m);
}

/// Lanes, boundaries or walls: of the pieces listed for the ego's cell, the first `capacity` whose middles are in
/// sight. Rows are written before it is known whether they count, which spares an unpredictable branch; the row after
/// the last may hold a leftover.
PICTURA_HD inline int observe_pieces(Span<const ObservedPiece> pieces, Span<const int32_t> items, const EgoFrame& frame,
                                     int capacity, float* out) {
  int count = 0;
  for (size_t i = 0; i < items.size() && count < capacity; ++i) {
    count += observe_piece(pieces[static_cast<size_t>(items[i])], frame, out + count * kLaneFeatures);
  }
  return count;
}
static_assert(kLaneFeatures == kBoundaryFeatures && kLaneFeatures == kWallFeatures);

PICTURA_HD constexpr float light_code(LightState state) {
  switch (state) {
    case LightState::red: return 1.0f;
    case LightState::yellow: return 0.5f;
    case LightState::green: return -1.0f;
    default: return 0.0f;
  }
}

/// The nearest stop lines: left and right end, height, state, and whether it holds the ego's lane.
template <typename ThreadGroup = SingleThread>
PICTURA_HD int observe_controls(const WorldView& world, int slot, const EgoFrame& frame, float* rows,
                                const ThreadGroup& group = {}) {
  const Span<const int32_t> items = items_at(world.map.near_stop_lines, frame.origin_m.xy());
  const int num_items = static_cast<int>(items.size());
  typename ThreadGroup::template Nearest<kMaxControls> nearest;
  for (int first = 0; first < num_items; first += group.size()) {
    const int i = first + group.rank();
    const int32_t light = items[static_cast<size_t>(min_of(i, num_items - 1))];
    const Vec2 apart = world.map.stop_lines[static_cast<size_t>(light)].middle_m.xy() - frame.origin_m.xy();
    const float d2 = dot(apart, apart);
    nearest.offer(i < num_items && d2 < square(kControlRange_m), d2, light);
  }
  const int32_t lane = world.agents.lane[slot];
  const int32_t own_light = lane < 0 ? -1 : world.map.lanes[static_cast<size_t>(lane)].light;
  const int count = nearest.count();
  for (int i = group.rank(); i < count; i += group.size()) {
    float* out = rows + i * kControlFeatures;
    const int32_t light = nearest.item(i);
    const StopLine& line = world.map.stop_lines[static_cast<size_t>(light)];
    const Vec3 left = frame.to_local(line.left_m);
    const Vec3 right = frame.to_local(line.right_m);
    out[0] = left.x * per(kScalePosition_m);
    out[1] = left.y * per(kScalePosition_m);
    out[2] = right.x * per(kScalePosition_m);
    out[3] = right.y * per(kScalePosition_m);
    out[4] = 0.5f * (left.z + right.z) * per(kScaleHeight_m);
    out[5] = light_code(world.lights[light]);
    out[6] = light == own_light ? 1.0f : 0.0f;
  }
  return count;
}

/// Zeros a set's rows from `count` to what the last observation of the slot filled, and one leftover at least.
PICTURA_HD inline void pad_set(float* out, int features, int capacity, int count, int32_t* filled_inout) {
  const int end = min_of(capacity, max_of(count + 1, *filled_inout));
  for (int i = count * features; i < end * features; ++i) out[i] = 0.0f;
  *filled_inout = count;
}

/// Whether anybody learns from or acts on the agent's observation: it drives, or this is its last one.
PICTURA_HD inline bool observes(const WorldView& world, int agent) {
  return is_active(world, agent) || (world.agents.events[world.first_slot + agent] & kInfractions) != 0;
}

/// What is no set: all zeros for the absent and for those that halted in an earlier step.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void observe_own(const WorldView& world, int agent, const ObservationView& out,
                            const ThreadGroup& group = {}) {
  const int slot = world.first_slot + agent;
  const size_t row = static_cast<size_t>(slot);
  float* ego = out.ego.data() + row * kEgoFeatures;
  float* conditioning = out.conditioning.data() + row * kNumConditioning;
  float* waypoints = out.waypoints.data() + row * kNumWaypoints * kWaypointFeatures;
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

/// Where a set of one slot is written.
struct SetRows {
  float* rows = nullptr;
  int features = 0, capacity = 0;
  int32_t* count = nullptr;
};

PICTURA_HD inline SetRows set_rows(const ObservationView& out, int slot, EntitySet set) {
  const size_t row = static_cast<size_t>(slot);
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

/// The pieces of a map that a set of them shows, and which of them can be seen from where the agent is.
struct PieceList {
  Span<const ObservedPiece> pieces;
  Span<const int32_t> items;
};

PICTURA_HD inline PieceList pieces_near(const WorldView& world, int slot, EntitySet set) {
  const Vec2 at{world.agents.x_m[slot], world.agents.y_m[slot]};
  const float heading_rad = world.agents.heading_rad[slot];
  const MapView& map = world.map;
  switch (set) {
    case EntitySet::lanes: return {map.lane_pieces, items_at(map.near_lane_pieces, at, heading_rad)};
    case EntitySet::walls: return {map.wall_pieces, items_at(map.near_wall_pieces, at, heading_rad)};
    default: return {map.boundary_pieces, items_at(map.near_boundary_pieces, at, heading_rad)};
  }
}

/// One entity set: empty for the absent and for those that halted in an earlier step.
PICTURA_HD inline void observe_set(const WorldView& world, int agent, EntitySet set, const ObservationView& out) {
  const int slot = world.first_slot + agent;
  const SetRows rows = set_rows(out, slot, set);
  int count = 0;
  if (observes(world, agent)) {
    const EgoFrame frame = ego_frame(world.agents, slot);
    if (set == EntitySet::partners) {
      count = observe_partners(world, agent, frame, rows.rows);
    } else if (set == EntitySet::controls) {
      count = observe_controls(world, slot, frame, rows.rows);
    } else {
      const PieceList near = pieces_near(world, slot, set);
      count = observe_pieces(near.pieces, near.items, frame, rows.capacity, rows.rows);
    }
  }
  pad_set(rows.rows, rows.features, rows.capacity, count, rows.count);
}

/// Writes the whole observation of one agent. Sets are written if `entity_sets`.
PICTURA_HD inline void observe(const WorldView& world, int agent, bool entity_sets, const ObservationView& out) {
  observe_own(world, agent, out);
  for (int set = 0; entity_sets && set < num_observed_sets(out); ++set) {
    observe_set(world, agent, static_cast<EntitySet>(set), out);
  }
}

}  // namespace pictura
