// Ego frame of an agent's observations: origin at the reference point, x forward, y to the left. Also contains the
// scales (docs/reference/observation.md) and the visible part of the map.
#pragma once

#include "pictura/simulator/rules/map_view.h"

namespace pictura {

// Quantities that are observed as 1.
constexpr float kScalePosition_m = 120.0f, kScaleHeight_m = 10.0f, kScaleSpeed_mps = 20.0f;
constexpr float kScaleLength_m = 6.0f, kScaleWidth_m = 3.0f, kScaleHalfPiece_m = 5.0f, kScaleLaneWidth_m = 5.0f;
constexpr float kScaleWallHeight_m = 12.0f;
constexpr float kMinConditioning = -2.0f;  // lower bound of observed conditioning
constexpr float kScaleSteer_rad = 0.55f, kScaleAccelLong_mps2 = 5.0f, kScaleAccelLat_mps2 = 4.0f;

/// Reciprocal of a scale. A division would take ten times as long as a multiplication.
PICTURA_HD constexpr float per(float scale) { return 1.0f / scale; }

// Ranges of visibility.
constexpr float kPartnerRange_m = 100.0f, kControlRange_m = 100.0f;
constexpr float kRoadAhead_m = 120.0f, kRoadBehind_m = 20.0f, kRoadAside_m = 30.0f;

struct EgoFrame {
  Vec3 origin_m;
  Vec2 forward;

  PICTURA_HD Vec2 turn(Vec2 v) const { return {dot(v, forward), cross(forward, v)}; }
  PICTURA_HD Vec3 to_local(Vec3 p) const {
    const Vec2 xy = turn(p.xy() - origin_m.xy());
    return {xy.x, xy.y, p.z - origin_m.z};
  }
};

constexpr float kRoadMiddle_m = 0.5f * (kRoadAhead_m - kRoadBehind_m);
constexpr float kRoadHalf_m = 0.5f * (kRoadAhead_m + kRoadBehind_m);

/// Whether the piece's middle is visible. fast/pieces_in_sight.h computes bit-identical results.
PICTURA_HD inline bool is_in_sight(const ObservedPiece& piece, const EgoFrame& frame) {
  const Vec2 local_m = frame.turn(piece.middle_m.xy() - frame.origin_m.xy());
  return fabsf(local_m.x - kRoadMiddle_m) <= kRoadHalf_m && fabsf(local_m.y) <= kRoadAside_m;
}

}  // namespace pictura
