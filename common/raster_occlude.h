// What hides whole faces: the walls and sides of boxes that cover most of an image. A face that lies behind one of
// them, in depth and on screen, need not be drawn. Shared by both devices.
#pragma once

#include "pictura/common/raster_coverage.h"
#include "pictura/common/raster_shapes.h"

namespace pictura {

/// The face of a solid on screen, all of it before the near plane.
struct Occluder {
  Vec3 side[4];           // how far inside of a side a point of the screen is, in px: x, y, and what is added
  Vec3 inverse_depth;     // likewise, of its plane
  float covered_px2 = 0;  // of the box around it that is in the image
};

/// Corners further from the image than this leave too few bits for what is between them.
constexpr float kMostOccluder_px = 4096.0f;
/// So far inside of an occluder, and behind it by this factor, nothing shows before it, whatever is rounded.
constexpr float kOccluderMargin_px = 0.05f, kOccluderLead = 1.002f;

/// Sets an occluder to a solid's face as a camera sees it; false where it hides nothing.
PICTURA_HD inline bool make_occluder(const PinholeCamera& camera, const Frustum& f, const CameraQuad& face,
                                     Occluder* out) {
  ScreenQuad quad;
  bool turns_right = false;
  for (int i = 0; i < 4; ++i) {
    if (face.corner[i].z < kNear_m) return false;
  }
  if (project_quad(camera, face.corner, 0.0f, &quad) == QuadSight::none ||
      !find_turn(quad, kLeastTwiceArea_px2, &turns_right))
    return false;
  const Vec2 low = quad.bounds.low, high = quad.bounds.high;
  const float width_px = static_cast<float>(camera.width_px), height_px = static_cast<float>(camera.height_px);
  if (low.x < -kMostOccluder_px || low.y < -kMostOccluder_px || high.x > width_px + kMostOccluder_px ||
      high.y > height_px + kMostOccluder_px) {
    return false;
  }
  const float sign = turns_right ? 1.0f : -1.0f;
  for (int i = 0; i < 4; ++i) {
    const Vec2 from = quad.corner[i], along = quad.corner[(i + 1) % 4] - from;
    const float length_px = length(along);
    if (length_px < 1e-3f) return false;
    const Vec2 inward = Vec2{-along.y, along.x} * (sign / length_px);
    out->side[i] = {inward.x, inward.y, -(inward.x * from.x + inward.y * from.y)};
  }
  out->inverse_depth = inverse_depth_plane(camera, f, face.plane);
  out->covered_px2 = (lesser_of(high.x, width_px) - greater_of(low.x, 0.0f)) *
                     (lesser_of(high.y, height_px) - greater_of(low.y, 0.0f));
  return out->covered_px2 > 0.0f;
}

/// The occluders of an image: those that cover most of it, of two that cover as much that of the lower entry.
class Occluders {
 public:
  static constexpr int kMost = 4;
  PICTURA_HD void clear() { count_ = 0; }
  /// Whether offer() would keep an occluder.
  PICTURA_HD bool wants(float covered_px2, uint32_t entry) const {
    return count_ < kMost || is_before(covered_px2, entry, kMost - 1);
  }
  PICTURA_HD void offer(const Occluder& occluder, uint32_t entry) {
    if (!wants(occluder.covered_px2, entry)) return;
    int at = count_ < kMost ? count_++ : kMost - 1;
    PICTURA_KEEP_LOOP
    for (; at > 0 && is_before(occluder.covered_px2, entry, at - 1); --at) {
      occluders_[at] = occluders_[at - 1];
      entries_[at] = entries_[at - 1];
    }
    occluders_[at] = occluder;
    entries_[at] = entry;
  }
  /// Whether one of them hides all of the image that is within the bounds of a face.
  PICTURA_HD bool hide(const PinholeCamera& camera, const ScreenBounds& bounds) const {
    const Vec2 low{greater_of(bounds.low.x, 0.0f), greater_of(bounds.low.y, 0.0f)};
    const Vec2 high{lesser_of(bounds.high.x, static_cast<float>(camera.width_px)),
                    lesser_of(bounds.high.y, static_cast<float>(camera.height_px))};
    // The least of a linear function over the box.
    auto least = [&](Vec3 of) {
      return of.x * (of.x > 0.0f ? low.x : high.x) + of.y * (of.y > 0.0f ? low.y : high.y) + of.z;
    };
    const float nearness = bounds.inverse_depth_high * kOccluderLead;
    bool is_hidden = false;
    PICTURA_KEEP_LOOP
    for (int k = 0; k < count_; ++k) {
      const Occluder& occluder = occluders_[k];
      float inside_px = least(occluder.side[0]);
      for (int i = 1; i < 4; ++i) inside_px = lesser_of(inside_px, least(occluder.side[i]));
      is_hidden = is_hidden || (inside_px >= kOccluderMargin_px && least(occluder.inverse_depth) >= nearness);
    }
    return is_hidden;
  }

 private:
  PICTURA_HD bool is_before(float covered_px2, uint32_t entry, int k) const {
    return covered_px2 > occluders_[k].covered_px2 || (covered_px2 == occluders_[k].covered_px2 && entry < entries_[k]);
  }
  Occluder occluders_[kMost];
  uint32_t entries_[kMost] = {};
  int32_t count_ = 0;
};

}  // namespace pictura
