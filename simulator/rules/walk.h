// Routes of pedestrians along walkways. At a dead end, a route turns back.
#pragma once

#include "pictura/common/rng.h"
#include "pictura/simulator/rules/road.h"

namespace pictura {

/// s_m is the distance from the start of the piece.
PICTURA_HD inline LanePose pose_on_walk(const MapView& map, int32_t piece_index, float s_m) {
  const WalkPiece& piece = map.walk_pieces[piece_index];
  const float along = clamp(s_m, 0.0f, piece.length_m);
  const Vec2 xy = piece.a_m.xy() + piece.direction * along;
  return {{xy.x, xy.y, height_on(piece, along)}, piece.heading_rad};
}

/// Returns the next piece of a random route. All pieces that leave its end, except the way back, are equally likely. At
/// a dead end, returns the way back.
PICTURA_HD inline int32_t choose_way(const MapView& map, int32_t piece_index, RandomStream* random_inout) {
  const WalkPiece& piece = map.walk_pieces[piece_index];
  if (piece.next >= 0) return piece.next;
  const int32_t begin = map.walk_leave_begin[piece.to_node];
  const int32_t end = map.walk_leave_begin[static_cast<size_t>(piece.to_node) + 1];
  const int32_t back = piece_index ^ 1;
  int32_t choice = random_inout->below(end - begin - 1);
  for (int32_t i = begin; i < end; ++i) {
    const int32_t way = map.walk_leaving[i];
    if (way != back && choice-- == 0) return way;
  }
  return back;
}

/// Point distance_m ahead on a random route.
PICTURA_HD inline RoutePoint advance_along_walkway(const MapView& map, RoutePoint at, float distance_m,
                                                   RandomStream* random_inout) {
  constexpr int kMaxPiecesWalked = 1024;  // a safety bound
  for (int i = 0; i < kMaxPiecesWalked; ++i) {
    const WalkPiece& piece = map.walk_pieces[at.lane];
    const float left_m = piece.length_m - at.s_m;
    if (distance_m <= left_m) return {at.lane, at.s_m + distance_m};
    distance_m -= left_m;
    at = {choose_way(map, at.lane, random_inout), 0.0f};
  }
  return {at.lane, 0.0f};
}

/// Variant of fit_lane() for pedestrians. The height is that of the nearest walkway within kWalkReach_m, unless a lane
/// is nearer.
template <typename ThreadGroup = SingleThread>
PICTURA_HD LaneFit fit_walk(const MapView& map, Vec2 p, float z_m, float heading_rad, int32_t current_lane,
                            const ThreadGroup& group = {}) {
  LaneFit fit = fit_lane(map, p, z_m, heading_rad, current_lane, group);
  float nearest_m = fit.lane < 0 ? kWalkReach_m : fabsf(fit.offset_m);
  const Span<const int32_t> items = items_at(map.walk_cells, p);
  const int num_items = static_cast<int>(items.size());
  int nearest_item = num_items;
  for (int i = group.rank(); i < num_items; i += group.size()) {
    const WalkPiece& piece = map.walk_pieces[2 * static_cast<size_t>(items[i])];
    const Vec2 from_a = p - piece.a_m.xy();
    const float along = clamp(dot(from_a, piece.direction), 0.0f, piece.length_m);
    const float distance_m = length(from_a - piece.direction * along);
    const float height = height_on(piece, along);
    if (distance_m >= nearest_m || fabsf(height - z_m) >= kLevel_m) continue;
    nearest_m = distance_m;
    nearest_item = i;
    fit.z_m = height;
  }
  fit.z_m = group.of_lowest(nearest_m, nearest_item, fit.z_m);
  return fit;
}

}  // namespace pictura
