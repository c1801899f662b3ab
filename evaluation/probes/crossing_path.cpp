#include "pictura/evaluation/probes/crossing_path.h"

#include <algorithm>
#include <cmath>

namespace pictura {

namespace {

constexpr float kSize_m = 0.5f, kWalkingSpeed_mps = 1.4f;
constexpr float kRadius_m = 0.36f;     // radius of the circle around a pedestrian's box
constexpr float kBehind_m = 0.8f;      // from the vehicle's far side to the path's origin
constexpr float kSameGround_m = 2.5f;  // objects at a larger height difference are on another level
constexpr float kTurns_rad[] = {radians_of(60), radians_of(90), radians_of(120)};

bool is_in(Vec2 position_m, const AgentBox& box) {
  const Vec2 apart = position_m - box.center_m.xy(), ahead{box.cos_heading, box.sin_heading};
  return std::abs(dot(apart, ahead)) < 0.5f * box.length_m + kRadius_m &&
         std::abs(cross(ahead, apart)) < 0.5f * box.width_m + kRadius_m;
}

float distance_m(Vec2 position_m, const WallFace& wall) {
  const Vec2 along = wall.b_m.xy() - wall.a_m.xy(), from_a = position_m - wall.a_m.xy();
  const float share = clamp(dot(from_a, along) / max_of(dot(along, along), 1e-6f), 0.0f, 1.0f);
  return length(from_a - along * share);
}

}  // namespace

InsertedBox CrossingPath::pedestrian(int i, float height_m) const {
  const Vec2 at_m = point_m(i);
  return {.box = {.center_m = {at_m.x, at_m.y, z_m},
                  .cos_heading = direction.x,
                  .sin_heading = direction.y,
                  .length_m = kSize_m,
                  .width_m = kSize_m,
                  .height_m = height_m,
                  .agent_class = AgentClass::pedestrian},
          .speed_mps = kWalkingSpeed_mps};
}

std::vector<CrossingPath> paths_behind(const AgentBox& box, Vec2 eye_m) {
  const Vec2 to_box = box.center_m.xy() - eye_m;
  const float distance = length(to_box);
  if (!(distance > 0)) return {};
  const Vec2 sight = to_box * (1 / distance), ahead{box.cos_heading, box.sin_heading};
  const float half_m =
      0.5f * (std::abs(dot(sight, ahead)) * box.length_m + std::abs(cross(sight, ahead)) * box.width_m);
  const Vec2 origin_m = box.center_m.xy() + sight * (half_m + kBehind_m);
  std::vector<CrossingPath> paths;
  for (const float turn_rad : kTurns_rad) {
    for (const float side : {-1.0f, 1.0f}) {
      const SinCos turn = sincos_of(side * turn_rad);
      paths.push_back({origin_m, sight * turn.cos + left_normal(sight) * turn.sin, box.center_m.z});
    }
  }
  return paths;
}

std::vector<bool> free_points(const CrossingPath& path, Span<const AgentBox> boxes, Span<const WallFace> walls) {
  std::vector<bool> is_free(kPathPoints, true);
  const Vec2 middle_m = (path.point_m(0) + path.point_m(kPathPoints - 1)) * 0.5f;
  const float half_m = 0.5f * (kPathBefore_m + kPathAfter_m);
  const auto stands_near = [&](float z_m) { return std::abs(z_m - path.z_m) < kSameGround_m; };
  const auto rule_out = [&](const auto& is_taken) {
    for (int i = 0; i < kPathPoints; ++i) {
      if (is_taken(path.point_m(i))) is_free[i] = false;
    }
  };
  for (const AgentBox& box : boxes) {
    const float reach_m = half_m + box.length_m + box.width_m;
    if (!box.drawn || !stands_near(box.center_m.z) || length(box.center_m.xy() - middle_m) > reach_m) continue;
    rule_out([&box](Vec2 at_m) { return is_in(at_m, box); });
  }
  for (const WallFace& wall : walls) {
    if (!stands_near(wall.a_m.z) || distance_m(middle_m, wall) > half_m + kRadius_m) continue;
    rule_out([&wall](Vec2 at_m) { return distance_m(at_m, wall) < kRadius_m; });
  }
  return is_free;
}

std::optional<PathPart> usable_part(Span<const float> visible_shares) {
  const auto is_hidden = [&](int i) { return i >= 0 && i < kPathPoints && visible_shares[i] == 0; };
  const auto is_visible = [&](int i) { return i < kPathPoints && visible_shares[i] > 0; };
  if (!is_hidden(kPathOrigin)) return {};
  constexpr int kHidden = static_cast<int>(kPathHidden_m / kPathSpacing_m),
                kSeen = static_cast<int>(kPathSeen_m / kPathSpacing_m),
                kEnd = static_cast<int>(kPathEnd_m / kPathSpacing_m);
  PathPart part{.begin = kPathOrigin, .first_seen = kPathOrigin};
  while (is_hidden(part.first_seen)) ++part.first_seen;
  while (is_hidden(part.begin - 1)) --part.begin;
  float most = 0;
  for (part.hidden_again = part.first_seen; is_visible(part.hidden_again); ++part.hidden_again)
    most = max_of(most, visible_shares[part.hidden_again]);
  for (part.end = part.hidden_again; is_hidden(part.end);) ++part.end;
  if (part.first_seen - part.begin < kHidden || part.end - part.hidden_again < kHidden) return {};
  if (part.hidden_again - part.first_seen < kSeen || most < kPathWhole) return {};
  part.begin = max_of(part.begin, part.first_seen - kEnd);
  part.end = min_of(part.end, part.hidden_again + kEnd);
  return part;
}

}  // namespace pictura
