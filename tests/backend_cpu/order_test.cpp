// The shared order rules against brute force: what faces share on screen, and which of two things is in front.
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "pictura/common/raster_check.h"
#include "pictura/common/raster_item.h"
#include "pictura/tests/support/image_scenes.h"

namespace pictura {
namespace {

// Things as a camera at eye_m that looks along x sees them, and their order.
class Sight {
 public:
  explicit Sight(Vec3 eye_m, float pitch_rad = 0) {
    Camera camera;
    camera.width_px = camera.height_px = 200;
    camera.focal_x_px = camera.focal_y_px = 60;
    camera.center_x_px = camera.center_y_px = 100;
    camera.position_m = eye_m;
    camera.pitch_rad = pitch_rad;
    setting_.camera = place_camera(pinhole_cameras({{camera}})[0], View{});
    setting_.frustum = make_frustum(setting_.camera);
    setting_.line_floor_px = 0.35f;
  }
  RasterItem see(const AgentBox& box) {
    return keep(agent_item(setting_, box, 0, 0), [&](auto&& emit) { agent_faces(box, setting_.camera, false, emit); });
  }
  RasterItem see(const WallFace& wall) {
    return keep(wall_item(setting_, wall, 0), [&](auto&& emit) { wall_faces(wall, setting_.camera, emit); });
  }
  RasterItem see(const Strip& strip, int32_t index = 0) {
    return keep(strip_item(setting_, strip, index),
                [&](auto&& emit) { strip_faces(strip, setting_.camera, setting_.line_floor_px, emit); });
  }
  // -1 the first is in front, 1 the second, 0 they do not meet.
  int order(const RasterItem& a, const RasterItem& b) const {
    const int32_t order = order_on_screen(a, b, faces_.data(), edges_.data());
    return (order > 0) - (order < 0);
  }

 private:
  struct Pool {
    std::vector<PolygonEdge>* edges;
    int32_t take(int count) {
      edges->resize(edges->size() + static_cast<std::size_t>(count));
      return static_cast<int32_t>(edges->size()) - count;
    }
    PolygonEdge* at(int32_t index) { return edges->data() + index; }
  };
  template <typename MakeFaces>
  RasterItem keep(RasterItem item, MakeFaces&& make_faces) {
    ItemFaces faces;
    Pool pool{&edges_};
    make_faces([&](const Vec3* corners, int count, const FacePlane& plane, Rgb color) {
      add_face(setting_, corners, count, plane, color, pool, &faces);
    });
    item.box = faces.box;
    item.face_begin = static_cast<int32_t>(faces_.size());
    faces_.insert(faces_.end(), faces.face, faces.face + faces.count);
    item.face_end = static_cast<int32_t>(faces_.size());
    return item;
  }

  ImageSetting setting_;
  std::vector<PolygonEdge> edges_;
  std::vector<ScreenFace> faces_;
};

Strip strip_between(Vec3 a_m, Vec3 b_m, StripKind kind = StripKind::lane_mark, float width_m = 0.2f) {
  Strip strip;
  strip.a_m = a_m;
  strip.b_m = b_m;
  const Vec2 along = b_m.xy() - a_m.xy();
  strip.side_a = strip.side_b = left_normal(along) * (1 / length(along));
  strip.width_m = width_m;
  strip.color = {1, 1, 1};
  strip.kind = kind;
  return strip;
}

// Corners of a convex polygon around a point, clockwise on screen.
std::vector<Vec2> random_polygon(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<float> angles(3 + random() % 4);
  for (float& angle : angles) angle = kTwoPi * unit(random);
  std::sort(angles.begin(), angles.end());
  const Vec2 center{50 + 6 * unit(random), 40 + 6 * unit(random)};
  const float rx = 0.5f + 8 * unit(random), ry = 0.1f + 4 * unit(random);
  std::vector<Vec2> polygon;
  for (const float angle : angles) polygon.push_back(center + Vec2{rx * cos_of(angle), ry * sin_of(angle)});
  return polygon;
}

ScreenFace append_face(const std::vector<Vec2>& polygon, std::vector<PolygonEdge>* edges) {
  ScreenFace face;
  face.edge_begin = static_cast<int32_t>(edges->size());
  face.edge_count = static_cast<int32_t>(polygon.size());
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    edges->push_back(make_edge(polygon[i], polygon[(i + 1) % polygon.size()]));
  }
  return face;
}

// Area of the intersection of two convex polygons, the one cut by the sides of the other.
double intersection_area(std::vector<Vec2> polygon, const std::vector<Vec2>& by) {
  for (std::size_t side = 0; side < by.size(); ++side) {
    const Vec2 from = by[side], to = by[(side + 1) % by.size()];
    auto inside = [&](Vec2 p) { return cross(to - from, p - from); };
    std::vector<Vec2> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 p = polygon[i], q = polygon[(i + 1) % polygon.size()];
      const float at_p = inside(p), at_q = inside(q);
      if (at_p >= 0) kept.push_back(p);
      if ((at_p >= 0) != (at_q >= 0)) kept.push_back(p + (q - p) * (at_p / (at_p - at_q)));
    }
    polygon = kept;
  }
  double twice_area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    twice_area += cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
  }
  return 0.5 * twice_area;
}

TEST(SharedRegion, HasTheAreaOfTheIntersectionAndLiesWithinIt) {
  std::mt19937 random(1);
  int meet = 0, apart = 0;
  for (int round = 0; round < 4000; ++round) {
    const std::vector<Vec2> a = random_polygon(random), b = random_polygon(random);
    std::vector<PolygonEdge> edges;
    const ScreenFace face_a = append_face(a, &edges), face_b = append_face(b, &edges);
    const SharedRegion region = shared_region(face_a, face_b, edges.data());
    const double expected = intersection_area(a, b);
    // Corners near x = 50 are known to 4e-6 px.
    ASSERT_NEAR(region.area_px2, expected, 1e-3) << round;
    (expected > 1e-3 ? meet : apart) += 1;
    if (expected <= 1e-3) continue;
    for (const PolygonEdge& edge : edges) {
      ASSERT_GE(inner_distance(edge, region.middle_px), -1e-3f) << round;
    }
  }
  EXPECT_GT(meet, 1000);
  EXPECT_GT(apart, 200);
}

TEST(SharedRegion, OfAFaceWithItselfIsTheFaceAndOfNeighboursNothing) {
  const std::vector<Vec2> left{{10, 10}, {14, 11}, {14, 13}, {10, 12}}, right{{14, 11}, {17, 9}, {17, 15}, {14, 13}};
  std::vector<PolygonEdge> edges;
  const ScreenFace a = append_face(left, &edges), b = append_face(right, &edges), again = append_face(left, &edges);
  EXPECT_NEAR(shared_region(a, again, edges.data()).area_px2, 2 * 8, 1e-4);  // both borders count
  EXPECT_NEAR(shared_region(a, b, edges.data()).area_px2, 0, 1e-4);
}

// Depth along x at which a ray (1, y, z) from the eye enters a box; -1 where it misses.
float enter(const AgentBox& box, Vec3 eye, Vec3 ray) {
  const Vec3 ahead{box.cos_heading, box.sin_heading, 0}, left{-box.sin_heading, box.cos_heading, 0}, up{0, 0, 1};
  const Vec3 middle = box.center_m + up * (0.5f * box.height_m) - eye;
  float from = 0, to = 1e9f;
  for (const auto& [axis, size] :
       {std::pair{ahead, box.length_m}, std::pair{left, box.width_m}, std::pair{up, box.height_m}}) {
    const float speed = dot(ray, axis), at = dot(middle, axis);
    const float t0 = (at - 0.5f * size) / speed, t1 = (at + 0.5f * size) / speed;
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  return from < to ? from : -1;
}

TEST(Order, OfDisjointBoxesIsWhatRaysSee) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> ahead(4, 40), aside(-15, 15), foot(-3, 1), size(0.2f, 20), angle(-3, 3);
  const Vec3 eye{0, 0, 1};
  int compared = 0;
  for (int round = 0; round < 4000; ++round) {
    auto box = [&] {
      return make_box(AgentClass::vehicle, {ahead(random), aside(random), foot(random)}, angle(random),
                      {size(random), 0.5f, 2});
    };
    const AgentBox a = box(), b = box();
    if (overlap_on_ground(agent_extent(a, eye), agent_extent(b, eye))) continue;
    Sight sight(eye);
    const RasterItem item_a = sight.see(a), item_b = sight.see(b);
    int a_first = 0, b_first = 0;
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        const Vec3 ray{1, (static_cast<float>(x) - 29.5f) / 20, (static_cast<float>(y) - 29.5f) / 20};
        const float at_a = enter(a, eye, ray), at_b = enter(b, eye, ray);
        if (at_a > kNear_m && at_b > kNear_m) (at_a < at_b ? a_first : b_first) += 1;
      }
    }
    if (a_first + b_first < 3) continue;
    ++compared;
    ASSERT_EQ(std::min(a_first, b_first), 0) << round;
    ASSERT_EQ(sight.order(item_a, item_b), a_first ? -1 : 1) << round;
    ASSERT_EQ(sight.order(item_b, item_a), a_first ? 1 : -1) << round;
  }
  EXPECT_GT(compared, 150);
}

TEST(Order, OfLevelsIsByHeight) {
  // A car on a bridge above a car, from below both, from above, and from between the two.
  const AgentBox low = make_box(AgentClass::vehicle, {12, 0, 0}, 0, {14, 2, 1.5f});
  const AgentBox high = make_box(AgentClass::vehicle, {12, 0, 6}, 0, {14, 2, 1.5f});
  const Strip bridge = strip_between({6, 0, 6}, {15, 0, 6});
  for (const auto& [eye_z, pitch, expected] :
       {std::tuple{-3.0f, 0.5f, -1}, std::tuple{20.0f, -0.9f, 1}, std::tuple{4.0f, 0.0f, 0}}) {
    Sight sight({0, 0, eye_z}, pitch);
    EXPECT_EQ(sight.order(sight.see(low), sight.see(high)), expected) << eye_z;
    EXPECT_EQ(sight.order(sight.see(low), sight.see(bridge)), expected) << eye_z;
  }
}

TEST(Order, StripsOfOneLevelGoByRankAndOthersByDepth) {
  const Strip mark = strip_between({10, -2, 0}, {18, 2, 0}, StripKind::lane_mark, 0.5f);
  for (const float height_m : {-0.04f, 0.0f, 0.04f}) {
    // An edge that crosses the mark, a little above or below it: rank.
    const Strip edge = strip_between({10, 2, height_m}, {18, -2, height_m}, StripKind::road_edge, 0.5f);
    const Strip stop = strip_between({10, 2, height_m}, {18, -2, height_m}, StripKind::stop_line, 0.5f);
    Sight sight({0, 0, 1.5f});
    EXPECT_EQ(sight.order(sight.see(mark), sight.see(edge)), -1) << height_m;
    EXPECT_EQ(sight.order(sight.see(mark), sight.see(stop)), 1) << height_m;
    EXPECT_EQ(sight.order(sight.see(mark, 7), sight.see(mark, 4)), 1);
  }
  for (const float height_m : {-0.5f, 0.5f}) {
    // On another level: the camera is above both, so the upper is in front.
    const Strip stop = strip_between({8, 4, height_m}, {20, -4, height_m}, StripKind::stop_line, 3.0f);
    Sight sight({0, 0, 3});
    EXPECT_EQ(sight.order(sight.see(mark), sight.see(stop)), height_m < 0 ? -1 : 1) << height_m;
  }
}

TEST(Order, WhatStandsOnAStripIsInFrontOfItEvenWhereItDipsIn) {
  // A road that falls by 15 % away from the camera, and a car upright on it: its near end lies 0.3 m below the road.
  const Strip mark = strip_between({10, 0, -1}, {20, 0, -2.5f});
  const AgentBox car = make_box(AgentClass::vehicle, {15, 0, -1.75f}, 0, {4, 2, 1.5f});
  Sight sight({0, 0, 1});
  EXPECT_EQ(sight.order(sight.see(mark), sight.see(car)), 1);
  EXPECT_EQ(sight.order(sight.see(car), sight.see(mark)), -1);
  // The same car beyond the end of the strip does not stand on it, and neither does one on a road 2 m below.
  EXPECT_TRUE(stands_on(agent_extent(car, {}), strip_extent(mark, 0, {})));
  AgentBox beyond = car;
  beyond.center_m.x = 23;
  EXPECT_FALSE(stands_on(agent_extent(beyond, {}), strip_extent(mark, 0, {})));
  AgentBox below = car;
  below.center_m.z -= 2;
  EXPECT_FALSE(stands_on(agent_extent(below, {}), strip_extent(mark, 0, {})));
}

TEST(Order, StripsInFrontOfAWallOrBehindIt) {
  WallFace wall;
  wall.a_m = {12, 10, -3};
  wall.b_m = {12, -10, -3};
  wall.height_m = 8;
  const Strip before = strip_between({6, 0, 0}, {11, 1, 0.3f}), beyond = strip_between({13, 0, 0}, {20, 1, 0.3f});
  Sight sight({0, 0, 1.5f});
  EXPECT_EQ(sight.order(sight.see(before), sight.see(wall)), -1);
  EXPECT_EQ(sight.order(sight.see(wall), sight.see(beyond)), -1);
}

}  // namespace
}  // namespace pictura
