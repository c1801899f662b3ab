#include "pictura/bench/truth/random_scenes.h"

#include <random>

namespace pictura {

namespace {

// A scene under construction, and its random numbers. A statement draws only one number, unless braces fix the order.
// Compilers evaluate function arguments in different orders, but a seed must always give the same scene.
class Maker {
 public:
  explicit Maker(uint64_t seed) : random_(seed) {}

  float between(float low, float high) {
    return low + (high - low) * static_cast<float>(random_() >> 40) / static_cast<float>(1 << 24);
  }
  int below(int count) { return static_cast<int>(random_() % static_cast<uint64_t>(count)); }
  bool one_in(int count) { return below(count) == 0; }
  template <std::size_t kCount>
  float one_of(const float (&values)[kCount]) {
    return values[below(static_cast<int>(kCount))];
  }

  void add_line(Vec3 a_m, Vec3 b_m, float width_m, StripKind kind) {
    add_polyline(&scene_.town.geometry, {a_m, b_m}, width_m, kind);
  }
  void add_line(Vec3 a_m, Vec3 b_m) {
    const auto kind = static_cast<StripKind>(below(4));
    add_line(a_m, b_m, one_of({0.15f, 0.3f, 0.5f}), kind);
  }
  void add_wall(Vec3 a_m, Vec3 b_m, float height_m) {
    const Rgb color{between(0.2f, 1), between(0.2f, 1), between(0.2f, 1)};
    scene_.town.geometry.walls.push_back({a_m, b_m, height_m, color});
  }
  void add_box(Vec3 center_m, float heading_rad, Vec3 size_m) {
    const auto agent_class = static_cast<AgentClass>(below(3));
    scene_.town.scene.agents.push_back(make_box(agent_class, center_m, heading_rad, size_m));
  }

  RandomScene finish(Vec3 eye_m, float heading_rad, float pitch_rad, float line_floor_px) {
    scene_.town.geometry.build_grids();
    scene_.town.scene.end_world(0);
    scene_.town.views = {make_view(eye_m, heading_rad)};
    scene_.config = {.rig = front_rig(), .num_threads = 1, .line_floor_px = line_floor_px};
    Camera& camera = scene_.config.rig.cameras[0];
    camera.position_m = {};
    camera.pitch_rad = pitch_rad;
    return scene_;
  }

 private:
  std::mt19937_64 random_;
  RandomScene scene_;
};

RandomScene make_near_plane(Maker m) {
  const float slope = m.one_in(3) ? m.between(-0.1f, 0.1f) : 0.0f;
  auto road = [slope](float x, float y) { return Vec3{x, y, slope * x}; };
  // Strips are horizontal across their width, so wide strips on a slope would not be on one level.
  auto width_m = [&] { return slope == 0 ? m.one_of({0.1f, 0.3f, 0.8f, 2.0f}) : m.one_of({0.1f, 0.3f}); };
  for (int i = 0; i < 6; ++i) {
    const float heading = m.between(0, kPi), ahead_m = m.between(0.3f, 6), behind_m = m.between(0.3f, 6);
    const Vec2 along{cos_of(heading), sin_of(heading)}, middle{m.between(-0.6f, 1.5f), m.between(-1, 1)};
    const auto kind = static_cast<StripKind>(m.below(4));
    m.add_line(road(middle.x - along.x * behind_m, middle.y - along.y * behind_m),
               road(middle.x + along.x * ahead_m, middle.y + along.y * ahead_m), width_m(), kind);
  }
  // On a slope, the box is placed beyond the strips, because a box on a strip and two strips in different planes may
  // occlude each other in a cycle.
  const float box_heading = m.between(0, kTwoPi), left_m = m.between(-2, 2),
              ahead_m = m.between(3, 9) + (slope == 0 ? 0.0f : 8.0f);
  m.add_box(road(ahead_m, left_m), box_heading, {4.2f, 1.8f, 1.5f});
  const float line_floor_px = m.one_of({0.0f, 0.35f, 0.35f, 2.0f}), pitch = m.between(-0.7f, 0.1f),
              heading = m.between(-0.5f, 0.5f);
  return m.finish({0, 0, m.one_of({0.03f, 0.1f, 0.4f, 1.5f})}, heading, pitch, line_floor_px);
}

RandomScene make_bridge_from_below(Maker m) {
  const float slope = m.one_in(3) ? m.between(-0.1f, 0.1f) : 0.0f, height_m = m.between(2.5f, 6);
  const float turn = m.between(-1.6f, 1.6f);
  // Returns the point of the bridge that is `along` metres from its begin and `left` metres to the left. The bridge
  // begins ahead of the camera.
  auto deck = [&](float along, float left) {
    return Vec3{7 + along * cos_of(turn) - left * sin_of(turn), along * sin_of(turn) + left * cos_of(turn),
                height_m + slope * along};
  };
  for (const float left : {-3.5f, -0.1f, 0.1f, 3.5f}) {
    m.add_line(deck(-20, left), deck(25, left), 0.15f, left * left > 1 ? StripKind::road_edge : StripKind::lane_mark);
  }
  const float line_at = m.between(-4, 4);
  m.add_line(deck(line_at, -3.5f), deck(line_at, 0), 0.4f, StripKind::stop_line);
  m.add_line(deck(line_at + 1.5f, -3.5f), deck(line_at + 1.5f, 3.5f), 0.3f, StripKind::crosswalk);
  for (int i = 0; i < 3; ++i) {
    const float box_height_m = m.between(1.3f, 1.9f), heading = turn + m.between(-0.4f, 0.4f),
                left_m = m.between(-3, 3), along_m = -9 + 7 * static_cast<float>(i) + m.between(0, 2);
    m.add_box(deck(along_m, left_m), heading, {4.4f, 1.9f, box_height_m});
  }
  if (m.one_in(3)) m.add_wall(deck(-15, 3.5f), deck(15, 3.5f), 1);
  m.add_line({0, 3, 0}, {30, 3, 0});
  const float pitch = m.between(0, 0.6f), heading = m.between(-0.3f, 0.3f);
  return m.finish({0, 0, 1.5f}, heading, pitch, 0.35f);
}

RandomScene make_crashed_boxes(Maker m) {
  const float heading = m.between(0, kTwoPi), heights_m[] = {1.5f, m.between(1.4f, 1.8f)};
  const Vec2 middle{m.between(6, 14), m.between(-3, 3)};
  const bool is_aligned = m.one_in(2);
  for (int i = 0; i < 4; ++i) {
    // Aligned boxes are one behind the other, so that their sides are in one plane.
    const float along = m.between(-3, 3), left = is_aligned ? 0 : m.between(-2, 2);
    const Vec3 at{middle.x + along * cos_of(heading) - left * sin_of(heading),
                  middle.y + along * sin_of(heading) + left * cos_of(heading), 0};
    const Vec3 size_m{m.between(3.8f, 5), 1.9f, m.one_of(heights_m)};
    m.add_box(at, is_aligned ? heading : m.between(0, kTwoPi), size_m);
  }
  for (int i = 0; i < 2; ++i) {
    const float end_y = m.between(-3, 3), begin_y = m.between(-3, 3);
    m.add_line({2, begin_y, 0}, {25, end_y, 0});
  }
  const float eye_m = m.between(1.2f, 5);
  return m.finish({0, 0, eye_m}, m.between(-0.2f, 0.2f), -0.05f * eye_m, 0.35f);
}

RandomScene make_intersecting_walls(Maker m) {
  for (int i = 0; i < 4; ++i) {
    const float x = m.between(4, 20), y = m.between(-6, 6), turn = m.between(0, kPi);
    const Vec3 along{8 * cos_of(turn), 8 * sin_of(turn), 0}, foot{x, y, -1};
    m.add_wall(foot - along, foot + along, m.between(2, 6));
  }
  for (int i = 0; i < 6; ++i) {
    const float height_m = m.between(1, 2), heading = m.between(0, kTwoPi);
    m.add_box({m.between(3, 14), m.between(-5, 5), 0}, heading, {0.6f, 0.6f, height_m});
  }
  const float heading = m.between(0, kTwoPi);
  m.add_box({m.between(5, 16), m.between(-5, 5), 0}, heading, {4.4f, 1.9f, 1.5f});
  return m.finish({0, 0, 1.5f}, m.between(-0.4f, 0.4f), 0, 0.35f);
}

// Makes a scene without solids, because if a strip and a solid intersect within a pixel, renderers draw one of them in
// front in the whole pixel (docs/explanation/image.md).
RandomScene make_wide_strips(Maker m) {
  for (int i = 0; i < 7; ++i) {
    const float x = m.between(3, 70), y = m.between(-12, 12), turn = m.between(0, kPi);
    const Vec3 along{20 * cos_of(turn), 20 * sin_of(turn), 0};
    m.add_line(Vec3{x, y, 0} - along, Vec3{x, y, 0} + along);
  }
  const float line_floor_px = m.one_of({2.0f, 4.0f, 8.0f}), pitch = m.between(-0.05f, 0.05f),
              heading = m.between(-0.2f, 0.2f);
  return m.finish({0, 0, m.one_of({0.3f, 0.8f, 1.5f})}, heading, pitch, line_floor_px);
}

RandomScene make_walls_on_strips(Maker m) {
  for (int i = 0; i < 3; ++i) {
    const float x = m.between(5, 20), turn = m.between(-1, 1), depth_m = m.between(0, 0.4f);
    const Vec3 along{-4 * sin_of(turn), 4 * cos_of(turn), 0}, foot{x, m.between(-5, 5), -depth_m};
    m.add_wall(foot - along, foot + along, depth_m + m.between(0.5f, 3));
  }
  // Strips are side by side, because two overlapping strips and a wall on one of them may occlude each other in a
  // cycle.
  const float turn = m.between(-0.8f, 0.8f);
  const Vec3 along{12 * cos_of(turn), 12 * sin_of(turn), 0};
  for (int i = 0; i < 6; ++i) {
    const Vec3 middle{m.between(10, 14), 2.5f * (static_cast<float>(i) - 2.5f), 0};
    m.add_line(middle - along, middle + along);
  }
  const float box_heading = m.between(0, kTwoPi);
  m.add_box({m.between(5, 20), m.between(-5, 5), m.between(-0.2f, 0)}, box_heading, {4.4f, 1.9f, 1.5f});
  const float pitch = m.between(-0.3f, 0), heading = m.between(-0.2f, 0.2f);
  return m.finish({0, 0, m.between(1, 4)}, heading, pitch, 0.35f);
}

RandomScene make_level_edges(Maker m) {
  // The tops are at nearly the same height on screen: each top is up to 0.15 px above the next top.
  const float eye_m = 1.5f, slope = m.between(0.05f, 0.2f);
  for (int i = 0; i < 5; ++i) {
    const float x = 6 + 4 * static_cast<float>(i), y = m.between(-4, 4), half_m = m.between(1, 4);
    const float top_m = eye_m + x * (slope + static_cast<float>(i) * m.between(0, 0.15f) / 77.25f);
    m.add_wall({x, y - half_m, 0}, {x, y + half_m, 0}, top_m);
  }
  for (int i = 0; i < 3; ++i) {
    const float height_m = m.between(1.3f, 2.5f), heading = m.one_of({0.0f, kHalfPi});
    m.add_box({m.between(5, 20), m.between(-4, 4), 0}, heading, {4.4f, 1.9f, height_m});
  }
  for (int i = 0; i < 4; ++i) {
    const float x = m.between(4, 30);
    m.add_line({x, -8, 0}, {x, 8, 0});
  }
  return m.finish({0, 0, eye_m}, 0, 0, 0.35f);
}

}  // namespace

RandomScene make_random_scene(RandomKind kind, uint64_t seed) {
  constexpr RandomScene (*kMakers[])(Maker) = {make_near_plane,         make_bridge_from_below, make_crashed_boxes,
                                               make_intersecting_walls, make_wide_strips,       make_walls_on_strips,
                                               make_level_edges};
  static_assert(std::size(kMakers) == kNumRandomKinds);
  return kMakers[static_cast<int>(kind)](Maker(seed));
}

}  // namespace pictura
