// Contact of boxes with each other and with barriers, and fault in collisions (paper, appendix, metric definitions).
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/scene_types.h"
#include "pictura/simulator/rules/map_view.h"
#include "pictura/simulator/rules/thread_group.h"

namespace pictura {

/// Rectangle on the ground.
struct OrientedBox {
  Vec2 center_m;
  Vec2 forward;  // unit vector
  float half_length_m = 0, half_width_m = 0;
};

PICTURA_HD inline OrientedBox footprint(const AgentBox& box) {
  return {box.center_m.xy(), {box.cos_heading, box.sin_heading}, 0.5f * box.length_m, 0.5f * box.width_m};
}

PICTURA_HD inline Vec2 front_bumper(const AgentBox& box) {
  return box.center_m.xy() + Vec2{box.cos_heading, box.sin_heading} * (0.5f * box.length_m);
}

PICTURA_HD inline float radius(const AgentBox& box) { return 0.5f * sqrtf(square(box.length_m) + square(box.width_m)); }

/// Half of the box's extent along the unit vector `axis`.
PICTURA_HD inline float half_extent(const OrientedBox& box, Vec2 axis) {
  return box.half_length_m * fabsf(dot(box.forward, axis)) + box.half_width_m * fabsf(cross(box.forward, axis));
}

/// Separating-axis test; touching counts as overlapping.
PICTURA_HD inline bool overlap(const OrientedBox& a, const OrientedBox& b) {
  const Vec2 between = b.center_m - a.center_m;
  const Vec2 axes[4] = {a.forward, left_normal(a.forward), b.forward, left_normal(b.forward)};
  for (int i = 0; i < 4; ++i) {
    if (fabsf(dot(between, axes[i])) > half_extent(a, axes[i]) + half_extent(b, axes[i])) return false;
  }
  return true;
}

PICTURA_HD inline bool same_level(const AgentBox& a, const AgentBox& b) {
  return a.center_m.z < b.center_m.z + b.height_m && b.center_m.z < a.center_m.z + a.height_m;
}

/// Interpolates between `from` (fraction 0) and `to` (fraction 1). Headings differ little within a step.
PICTURA_HD inline OrientedBox between(const AgentBox& from, const AgentBox& to, float fraction) {
  OrientedBox box = footprint(to);
  const Vec2 start{from.cos_heading, from.sin_heading};
  box.center_m = from.center_m.xy() + (to.center_m - from.center_m).xy() * fraction;
  const Vec2 forward = start + (box.forward - start) * fraction;
  const float norm = length(forward);
  if (norm > 0.0f) box.forward = forward * (1.0f / norm);
  return box;
}

/// Whether two boxes touch during a step or at its end. Between two samples of the motion, the boxes approach each
/// other by less than the narrower box's width.
PICTURA_HD inline bool collide(const AgentBox& a_from, const AgentBox& a_to, const AgentBox& b_from,
                               const AgentBox& b_to) {
  const Vec2 a_path = (a_to.center_m - a_from.center_m).xy();
  const Vec2 b_path = (b_to.center_m - b_from.center_m).xy();
  const float approach = length(a_path - b_path);
  const Vec2 apart = (b_to.center_m - a_to.center_m).xy();
  if (dot(apart, apart) > square(radius(a_to) + radius(b_to) + approach) || !same_level(a_to, b_to)) return false;
  if (overlap(footprint(a_to), footprint(b_to))) return true;
  constexpr int kMaxSubsteps = 16;
  const int substeps = clamp(static_cast<int>(approach / (0.5f * min_of(a_to.width_m, b_to.width_m))), 0, kMaxSubsteps);
  for (int i = 1; i <= substeps; ++i) {
    const float fraction = static_cast<float>(i) / static_cast<float>(substeps + 1);
    if (overlap(between(a_from, a_to, fraction), between(b_from, b_to, fraction))) return true;
  }
  return false;
}

/// Whether an agent is at fault for a collision (paper). An agent that is almost at rest or struck from behind is not
/// at fault. A reversing agent is never struck from behind. A forward-moving agent is struck from behind if the other
/// box's nearer end was behind the agent's rear bumper before the step. own_speed_mps is the speed in the step.
PICTURA_HD inline bool at_fault(const AgentBox& own_before, float own_speed_mps, const AgentBox& other_before) {
  constexpr float kStopped_mps = 0.2f;
  if (fabsf(own_speed_mps) < kStopped_mps) return false;
  if (own_speed_mps < 0.0f) return true;
  const Vec2 forward{own_before.cos_heading, own_before.sin_heading};
  const Vec2 other_forward{other_before.cos_heading, other_before.sin_heading};
  const float rear = -0.5f * own_before.length_m;
  const float nearer_end = dot((other_before.center_m - own_before.center_m).xy(), forward) +
                           0.5f * other_before.length_m * fabsf(dot(other_forward, forward));
  return nearer_end > rear;
}

/// Whether the segment a-b touches the box.
PICTURA_HD inline bool touches(const OrientedBox& box, Vec2 a_m, Vec2 b_m) {
  const Vec2 a = a_m - box.center_m;
  const Vec2 step = b_m - a_m;
  float enter = 0.0f, leave = 1.0f;
  const Vec2 axes[2] = {box.forward, left_normal(box.forward)};
  const float half[2] = {box.half_length_m, box.half_width_m};
  for (int i = 0; i < 2; ++i) {
    const float start = dot(a, axes[i]);
    const float slope = dot(step, axes[i]);
    if (slope == 0.0f) {
      if (fabsf(start) > half[i]) return false;
      continue;
    }
    const float t0 = (-half[i] - start) / slope;
    const float t1 = (half[i] - start) / slope;
    enter = max_of(enter, min_of(t0, t1));
    leave = min_of(leave, max_of(t0, t1));
    if (enter > leave) return false;
  }
  return true;
}

/// Whether the box touches a barrier on its level. A test at the end of each step suffices, because a box is longer
/// than its motion in a step.
template <typename ThreadGroup = SingleThread>
PICTURA_HD bool touches_any(const OrientedBox& box, float z_m, Span<const Barrier> barriers, const GridView& cells,
                            const ThreadGroup& group = {}) {
  const float reach = box.half_length_m + box.half_width_m;
  const Span<const int32_t> items = items_at(cells, box.center_m);
  bool found = false;
  for (size_t i = static_cast<size_t>(group.rank()); i < items.size() && !found;
       i += static_cast<size_t>(group.size())) {
    const Barrier& barrier = barriers[items[i]];
    const Vec2 to_middle = (barrier.a_m + barrier.b_m) * 0.5f - box.center_m;
    const Vec2 half = (barrier.b_m - barrier.a_m) * 0.5f;
    if (fabsf(to_middle.x) > fabsf(half.x) + reach || fabsf(to_middle.y) > fabsf(half.y) + reach) continue;
    found = fabsf(barrier.z_m - z_m) < kLevel_m && touches(box, barrier.a_m, barrier.b_m);
  }
  return group.any(found);
}

}  // namespace pictura
