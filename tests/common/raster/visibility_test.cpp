// The visibility rules of common/raster compared with brute force: which of two faces is in front, and the visible
// samples of a pixel's fragments.
#include <algorithm>
#include <bit>
#include <random>

#include <gtest/gtest.h>

#include "pictura/bench/truth/image_scenes.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/check.h"
#include "pictura/common/raster/face_setup.h"

namespace pictura {
namespace {

using Extents = std::vector<std::pair<uint32_t, Extent>>;

// A camera at eye_m that faces along x: sets up faces of primitives and compares their order.
class TestView {
 public:
  // Faces of a primitive.
  using Faces = std::vector<ScreenFace>;

  explicit TestView(Vec3 eye_m, float pitch_rad = 0, float line_floor_px = 0.35f) {
    Camera camera;
    camera.width_px = camera.height_px = kSize;
    camera.focal_x_px = camera.focal_y_px = 60;
    camera.center_x_px = camera.center_y_px = 0.5f * kSize;
    camera.position_m = eye_m;
    camera.pitch_rad = pitch_rad;
    setting_.camera = place_camera(pinhole_cameras({{camera}})[0], View{});
    setting_.frustum = make_frustum(setting_.camera);
    setting_.line_floor_px = line_floor_px;
  }
  Faces set_up(const AgentBox& box, int32_t index = 0) {
    return keep(agent_ref(box, index), extent_of(box),
                [&](auto&& emit) { agent_faces(box, setting_.camera, false, emit); });
  }
  Faces set_up(const WallFace& wall) {
    return keep(wall_ref(0), extent_of(wall), [&](auto&& emit) { wall_faces(wall, setting_.camera, emit); });
  }
  Faces set_up(const Strip& strip, int32_t index = 0) {
    return keep(strip_ref(strip, index), extent_of(strip),
                [&](auto&& emit) { strip_faces(strip, setting_.camera, setting_.line_floor_px, emit); });
  }
  // Calls visit(face of a, face of b, point) for a grid of points of the image that both faces cover.
  template <typename Visit>
  void for_each_overlap(const Faces& a, const Faces& b, Visit&& visit) const {
    for (const ScreenFace& of_a : a) {
      for (const ScreenFace& of_b : b) {
        const PixelBox box = of_a.box;
        for (float y = static_cast<float>(box.y_begin) + 0.1f; y < static_cast<float>(box.y_end); y += kStep_px) {
          for (float x = static_cast<float>(box.x_begin) + 0.1f; x < static_cast<float>(box.x_end); x += kStep_px) {
            if (covers(of_a, {x, y}) && covers(of_b, {x, y})) visit(of_a, of_b, Vec2{x, y});
          }
        }
      }
    }
  }
  bool in_front(const ScreenFace& a, const ScreenFace& b, Vec2 at) const {
    return is_in_front(a, b, at,
                       [&](uint32_t solid, uint32_t strip) { return stands_on(extent(solid), extent(strip)); });
  }
  // -1: the first is in front wherever both overlap, 1: the second, 0: they do not overlap, 2: it depends on the point.
  int order(const Faces& a, const Faces& b) const {
    int first = 0, second = 0;
    for_each_overlap(a, b, [&](const ScreenFace& of_a, const ScreenFace& of_b, Vec2 at) {
      EXPECT_NE(in_front(of_a, of_b, at), in_front(of_b, of_a, at));
      (in_front(of_a, of_b, at) ? first : second) += 1;
    });
    return first && second ? 2 : first ? -1 : second ? 1 : 0;
  }
  Vec3 ray(Vec2 at) const {
    const PinholeCamera& camera = setting_.camera;
    return camera.right * ((at.x - camera.center_x_px) / camera.focal_x_px) +
           camera.down * ((at.y - camera.center_y_px) / camera.focal_y_px) + camera.forward;
  }

 private:
  static constexpr int kSize = 100;
  static constexpr float kStep_px = 0.2f;
  struct Pool {
    std::vector<PolygonEdge>* edges;
    int32_t take(int count) {
      edges->resize(edges->size() + static_cast<std::size_t>(count));
      return static_cast<int32_t>(edges->size()) - count;
    }
    void put(int32_t index, const PolygonEdge& edge) { (*edges)[index] = edge; }
  };
  template <typename MakeFaces>
  Faces keep(PrimitiveRef primitive, const Extent& extent, MakeFaces&& make_faces) {
    Faces faces;
    Pool pool{&edges_};
    make_faces([&](const CameraFace& seen) {
      ScreenFace face;
      if (make_face(setting_, primitive, seen, pool, &face)) faces.push_back(face);
    });
    extents_.emplace_back(primitive.object_id, extent);
    return faces;
  }
  bool covers(const ScreenFace& face, Vec2 at) const {
    return covers_point(edges_.data() + face.edge_begin, face.edge_count, at.x, at.y);
  }
  // The extent of the last primitive with this object id.
  const Extent& extent(uint32_t object_id) const {
    return std::find_if(extents_.rbegin(), extents_.rend(), [&](const auto& seen) { return seen.first == object_id; })
        ->second;
  }

  ImageSetting setting_;
  std::vector<PolygonEdge> edges_;
  Extents extents_;
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

// Distance at which a ray from the eye enters a box, in multiples of the ray's length; -1 if it misses.
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

TEST(Order, DisjointBoxesAreOrderedAsRaysHitThem) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> ahead(4, 40), aside(-15, 15), foot(-3, 1), size(0.2f, 20), angle(-3, 3);
  const Vec3 eye{0, 0, 1};
  int compared = 0;
  for (int round = 0; round < 1500; ++round) {
    auto box = [&] {
      return make_box(AgentClass::vehicle, {ahead(random), aside(random), foot(random)}, angle(random),
                      {size(random), 0.5f, 2});
    };
    const AgentBox a = box(), b = box();
    if (overlap_on_ground(extent_of(a), extent_of(b))) continue;
    TestView view(eye);
    const TestView::Faces seen_a = view.set_up(a, 0), seen_b = view.set_up(b, 1);
    view.for_each_overlap(seen_a, seen_b, [&](const ScreenFace& of_a, const ScreenFace& of_b, Vec2 at) {
      const float at_a = enter(a, eye, view.ray(at)), at_b = enter(b, eye, view.ray(at));
      if (at_a < 0 || at_b < 0) return;  // at the border, where rounding decides
      EXPECT_EQ(view.in_front(of_a, of_b, at), at_a < at_b) << round;
      ++compared;
    });
  }
  EXPECT_GT(compared, 20000);
}

TEST(Order, LevelsAreOrderedByHeight) {
  // A car on a bridge above another car, seen from below both, from above, and from between.
  const AgentBox low = make_box(AgentClass::vehicle, {12, 0, 0}, 0, {14, 2, 1.5f});
  const AgentBox high = make_box(AgentClass::vehicle, {12, 0, 6}, 0, {14, 2, 1.5f});
  const Strip bridge = strip_between({6, 0, 6}, {15, 0, 6});
  for (const auto& [eye_z, pitch, expected] :
       {std::tuple{-3.0f, 0.5f, -1}, std::tuple{20.0f, -0.9f, 1}, std::tuple{4.0f, 0.0f, 0}}) {
    TestView view({0, 0, eye_z}, pitch);
    EXPECT_EQ(view.order(view.set_up(low, 0), view.set_up(high, 1)), expected) << eye_z;
    EXPECT_EQ(view.order(view.set_up(low), view.set_up(bridge)), expected) << eye_z;
  }
}

TEST(Order, StripsOfOneLevelAreOrderedByRankAndOthersByDepth) {
  const Strip mark = strip_between({10, -2, 0}, {18, 2, 0}, StripKind::lane_mark, 0.5f);
  for (const float height_m : {-0.04f, 0.0f, 0.04f}) {
    // An edge that crosses the mark, slightly above or below it: the rank decides.
    const Strip edge = strip_between({10, 2, height_m}, {18, -2, height_m}, StripKind::road_edge, 0.5f);
    const Strip stop = strip_between({10, 2, height_m}, {18, -2, height_m}, StripKind::stop_line, 0.5f);
    TestView view({0, 0, 1.5f});
    EXPECT_EQ(view.order(view.set_up(mark), view.set_up(edge)), -1) << height_m;
    EXPECT_EQ(view.order(view.set_up(mark), view.set_up(stop)), 1) << height_m;
    EXPECT_EQ(view.order(view.set_up(mark, 7), view.set_up(mark, 4)), 1);
  }
  for (const float height_m : {-0.5f, 0.5f}) {
    // On different levels: the camera is above both, so the upper strip is in front.
    const Strip stop = strip_between({8, 4, height_m}, {20, -4, height_m}, StripKind::stop_line, 3.0f);
    TestView view({0, 0, 3});
    EXPECT_EQ(view.order(view.set_up(mark), view.set_up(stop)), height_m < 0 ? -1 : 1) << height_m;
  }
}

TEST(Order, ObjectsOnAStripAreInFrontEvenWherePartlyBelowIt) {
  // A road that falls by 15 % away from the camera, and a car upright on it: its near end lies 0.3 m below the road.
  const Strip mark = strip_between({10, 0, -1}, {20, 0, -2.5f});
  const AgentBox car = make_box(AgentClass::vehicle, {15, 0, -1.75f}, 0, {4, 2, 1.5f});
  TestView view({0, 0, 1});
  EXPECT_EQ(view.order(view.set_up(mark), view.set_up(car)), 1);
  EXPECT_EQ(view.order(view.set_up(car), view.set_up(mark)), -1);
  // From below the road, the mark is in front of the car, even where the car extends below it.
  TestView from_below({0, 0, -4}, 0.15f);
  EXPECT_EQ(from_below.order(from_below.set_up(mark), from_below.set_up(car)), -1);
  // The same car beyond the end of the strip does not stand on it, and neither does a car on a road 2 m below.
  EXPECT_TRUE(stands_on(extent_of(car), extent_of(mark)));
  AgentBox beyond = car;
  beyond.center_m.x = 23;
  EXPECT_FALSE(stands_on(extent_of(beyond), extent_of(mark)));
  AgentBox below = car;
  below.center_m.z -= 2;
  EXPECT_FALSE(stands_on(extent_of(below), extent_of(mark)));
}

// A face without edges, of a solid unless said otherwise, whose plane has the given inverse depth at a pixel's corner
// and the given gradient.
ScreenFace plane_face(uint32_t object_id, float inverse_depth_0, Vec2 gradient = {}) {
  ScreenFace face;
  face.object_id = object_id;
  face.inverse_depth_0 = inverse_depth_0;
  face.inverse_depth_x = gradient.x;
  face.inverse_depth_y = gradient.y;
  face.inverse_depth_low = 1e-3f;
  face.inverse_depth_high = 10;
  return face;
}

TEST(Order, FacesInOnePlaneAreOrderedByObject) {
  // The two planes differ only by rounding, in either direction.
  auto never = [](uint32_t, uint32_t) { return false; };
  for (const float noise : {0.0f, 1e-7f, -1e-7f}) {
    for (const Vec2 tilt : {Vec2{}, Vec2{0.01f, 0.002f}}) {
      const ScreenFace first = plane_face(make_object_id(kAgentKind, 3), 0.1f, tilt),
                       second = plane_face(make_object_id(kAgentKind, 7), 0.1f + noise, {tilt.x - noise, tilt.y});
      EXPECT_EQ(samples_in_front(first, second, kAllSamples, {}, false, never), kAllSamples);
      EXPECT_EQ(samples_in_front(second, first, kAllSamples, {}, false, never), 0u);
      EXPECT_TRUE(passes_occluder_bound(first, occluder_bound(second, 0, 0), 0, 0));
      for (const bool swapped : {false, true}) {
        FrontFace front;
        const ScreenFace *const one = swapped ? &second : &first, *const other = swapped ? &first : &second;
        for (const ScreenFace* face : {one, other}) front.add(*face, {0.5f, 0.5f});
        ASSERT_TRUE(front.needs_second_pass());
        for (const ScreenFace* face : {one, other}) front.add_second_pass(*face, {0.5f, 0.5f});
        EXPECT_EQ(front.front({0.5f, 0.5f}, never), &first);
      }
    }
  }
}

TEST(Order, AStripSeenFromBelowIsHiddenByObjectsThatDoNotStandOnIt) {
  ScreenFace strip = plane_face(make_object_id(kStripKind, 0), 0.02f);
  for (const auto& [above_eye_m, hiding] :
       {std::pair{-1.5f, 1.0f}, {2 * kThroughStrip_m, 2.0f}, {3 * kThroughStrip_m, 1.5f}}) {
    strip.nearest_standing = nearest_standing(above_eye_m);
    EXPECT_TRUE(passes_occluder_bound(strip, 0.99f * hiding * 0.02f, 0, 0)) << above_eye_m;
    EXPECT_FALSE(passes_occluder_bound(strip, 1.01f * hiding * 0.02f, 0, 0)) << above_eye_m;
  }
  for (const float above_eye_m : {0.01f, kThroughStrip_m}) {
    strip.nearest_standing = nearest_standing(above_eye_m);
    EXPECT_TRUE(passes_occluder_bound(strip, 1e6f, 0, 0)) << above_eye_m;
  }
}

TEST(Order, StripsInFrontOfAWallOrBehindIt) {
  WallFace wall;
  wall.a_m = {12, 10, -3};
  wall.b_m = {12, -10, -3};
  wall.height_m = 8;
  const Strip before = strip_between({6, 0, 0}, {11, 1, 0.3f}), beyond = strip_between({13, 0, 0}, {20, 1, 0.3f});
  TestView view({0, 0, 1.5f});
  EXPECT_EQ(view.order(view.set_up(before), view.set_up(wall)), -1);
  EXPECT_EQ(view.order(view.set_up(wall), view.set_up(beyond)), -1);
}

TEST(Order, AWallStandsOnTheStripsThatItCrosses) {
  const Strip mark = strip_between({5, 0, 0}, {15, 0, 0});
  // The wall's lower edge is 0.3 m below the road, along, across and oblique to the mark.
  for (const Vec3 reach : {Vec3{3, 0, 0}, Vec3{0, 3, 0}, Vec3{2, -3, 0}}) {
    const Vec3 middle{10, 0, -0.3f};
    const WallFace wall{middle - reach, middle + reach, 2, {1, 1, 1}};
    EXPECT_TRUE(stands_on(extent_of(wall), extent_of(mark))) << reach.y;
    WallFace beside = wall;
    beside.a_m.y += 4;
    beside.b_m.y += 4;
    EXPECT_FALSE(stands_on(extent_of(beside), extent_of(mark))) << reach.y;
  }
  const WallFace across{{10, 3, -0.3f}, {10, -3, -0.3f}, 2, {1, 1, 1}};
  TestView view({0, 0, 1.5f});
  EXPECT_EQ(view.order(view.set_up(across), view.set_up(mark)), -1);
}

TEST(Order, StripsOfOneLevelAreOrderedByRankBeyondTheirHorizon) {
  // Drawn 8 px wide, the strips extend above the horizon; the edge is nearer.
  const Strip edge = strip_between({20, 6, 0}, {20, -6, 0}, StripKind::road_edge),
              stop = strip_between({45, 6, 0}, {45, -6, 0}, StripKind::stop_line);
  TestView view({0, 0, 0.3f}, 0, 8);
  EXPECT_EQ(view.order(view.set_up(stop), view.set_up(edge)), -1);
}

TEST(Order, AWidenedStripKeepsItsDepth) {
  // The strip's plane almost contains the eye: in that plane, half of the strip's width on screen would be much nearer,
  // and half beyond the horizon.
  const Strip strip = strip_between({40, -4, 0.9995f}, {45, 4, 0.9985f});
  for (const float wall_at_m : {15.0f, 110.0f}) {
    WallFace wall;
    wall.a_m = {wall_at_m, 10, -3};
    wall.b_m = {wall_at_m, -10, -3};
    wall.height_m = 8;
    TestView view({0, 0, 1});
    EXPECT_EQ(view.order(view.set_up(strip), view.set_up(wall)), wall_at_m < 40 ? 1 : -1) << wall_at_m;
  }
}

TEST(Order, ComparesAtTheCentroidOfTheSharedSamples) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 2000; ++round) {
    const uint64_t samples = round % 3 ? random() & random() & random() : random();
    double x = 0, y = 0;
    for (int column = 0; column < kSampleColumns; ++column) {
      for (int row = 0; row < 8; ++row) {
        if (!(samples >> (8 * column + row) & 1)) continue;
        x += (column + 0.5) / 8;
        y += (row + static_cast<double>(sample_column_offset(column))) / 8;
      }
    }
    const int count = std::popcount(samples);
    if (count == 0) continue;
    EXPECT_NEAR(centroid_of(samples).x, x / count, 1e-6) << samples;
    EXPECT_NEAR(centroid_of(samples).y, y / count, 1e-6) << samples;
  }
  EXPECT_EQ(centroid_of(kAllSamples).x, 0.5f);
  EXPECT_EQ(centroid_of(kAllSamples).y, 0.5f);
  EXPECT_EQ(centroid_of(0).x, 0.5f);
}

TEST(Order, IntersectingSolidsDivideSamplesByDepth) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<float> unit(0, 1);
  auto never = [](uint32_t, uint32_t) { return false; };
  int split = 0, tied = 0;
  for (int round = 0; round < 2000; ++round) {
    // Every second pair is nearly in one plane, so that both faces are equally near in much of the pixel.
    const float tilt = round % 2 ? 1.0f : 2e-3f;
    auto plane = [&](uint32_t object_id) {
      const float inverse_depth = 0.1f + 0.02f * tilt * unit(random);
      return plane_face(object_id, inverse_depth, Vec2{unit(random) - 0.5f, unit(random) - 0.5f} * (0.02f * tilt));
    };
    const ScreenFace a = plane(make_object_id(kWallKind, 5)), b = plane(make_object_id(kAgentKind, 3));
    const uint64_t shared = random() | random();
    const Vec2 corner{static_cast<float>(round % 3), static_cast<float>(round % 5)};
    const uint64_t a_first = samples_in_front(a, b, shared, corner, false, never);
    ASSERT_EQ(samples_in_front(b, a, shared, corner, false, never), shared & ~a_first) << round;
    split += a_first != 0 && a_first != shared;
    for (int sample = 0; sample < 64; ++sample) {
      if (!(shared >> sample & 1)) continue;
      const Vec2 at = corner + centroid_of(uint64_t{1} << sample);
      const float nearest = std::max(inverse_depth(a, at), inverse_depth(b, at));
      const float lead = inverse_depth(a, at) - inverse_depth(b, at), beyond_tie = lead - kEqualDepth * nearest;
      // Almost upright lines are rotated by up to this much in a pixel (see make_edge).
      const Vec2 gradient{a.inverse_depth_x - b.inverse_depth_x, a.inverse_depth_y - b.inverse_depth_y};
      if (std::abs(beyond_tie) < 0.5f / kSteepest * length(gradient)) continue;
      ASSERT_EQ(a_first >> sample & 1, beyond_tie > 0 ? 1u : 0u) << round;
      tied += lead > 0 && beyond_tie <= 0;
    }
  }
  EXPECT_GT(split, 200);
  EXPECT_GT(tied, 2000);
}

TEST(Order, TwoIntersectingFullFacesFillThePixelTogether) {
  // The first is in front in the left 5/8 of the pixel.
  const ScreenFace first = plane_face(make_object_id(kAgentKind, 0), 0.2f, {-0.08f, 0}),
                   second = plane_face(make_object_id(kAgentKind, 1), 0.15f);
  const PixelCoverage full{1, kAllSamples};
  const OccludedSamples occluded =
      occlude_pair(full, full, first, second, {}, [](uint32_t, uint32_t) { return false; });
  PixelAccumulator sum;
  sum.add(PixelAccumulator::weight_of(full, ~occluded.of_a), {1, 0, 0});
  sum.add(PixelAccumulator::weight_of(full, ~occluded.of_b), {0, 1, 0});
  EXPECT_NEAR(sum.color().r, 5.0 / 8, 1e-5);
  EXPECT_NEAR(sum.color().g, 3.0 / 8, 1e-5);
}

TEST(Order, IntersectingFullFacesDivideTheAreaLeftByAThirdFace) {
  // The first of the two is in front in the left 5/8 of the pixel; a third face hides the left half.
  const ScreenFace first = plane_face(make_object_id(kAgentKind, 0), 0.2f, {-0.08f, 0}),
                   second = plane_face(make_object_id(kAgentKind, 1), 0.15f);
  const PixelCoverage full{1, kAllSamples};
  const OccludedSamples occluded =
      occlude_pair(full, full, first, second, {}, [](uint32_t, uint32_t) { return false; });
  for (const bool hides_all : {false, true}) {
    // All samples may be hidden although some of the area is left.
    const PixelCoverage third = hides_all ? PixelCoverage{0.99f, kAllSamples} : PixelCoverage{0.5f, 0xFFFFFFFF};
    const PixelCoverage coverage[] = {full, third, full};
    uint64_t visible[] = {~occluded.of_a, third.samples, ~occluded.of_b};
    divide_remainder([&](auto&& visit) {
      for (int i = 0; i < 3; ++i) visit(coverage[i], &visible[i]);
    });
    PixelAccumulator sum;
    const Rgb colors[] = {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}};
    for (int i = 0; i < 3; ++i) sum.add(PixelAccumulator::weight_of(coverage[i], visible[i]), colors[i]);
    EXPECT_NEAR(sum.color().r, hides_all ? 0.01 * 5 / 8 : 1.0 / 8, 1e-5);
    EXPECT_NEAR(sum.color().g, hides_all ? 0.01 * 3 / 8 : 3.0 / 8, 1e-5);
    EXPECT_NEAR(sum.color().b, third.area, 1e-5);
  }
}

TEST(Order, VisibleSamplesDoNotDependOnTheOrderOfFragments) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 500; ++round) {
    // Planes in one pixel; randomly tilted planes intersect, and strips among them may occlude each other in a cycle.
    const float tilt = round % 2 ? 0.1f : 0.0f;
    const bool with_strips = round % 4 == 3;
    std::vector<ScreenFace> faces(2 + random() % 6);
    std::vector<Fragment> fragments;
    for (std::size_t i = 0; i < faces.size(); ++i) {
      faces[i] = plane_face(make_object_id(with_strips && i % 2 ? kStripKind : kAgentKind, static_cast<int32_t>(i)),
                            0.05f + 0.05f * unit(random), Vec2{unit(random) - 0.5f, unit(random) - 0.5f} * tilt);
      faces[i].color = {unit(random), unit(random), unit(random)};
      const uint64_t samples = random() & (round % 3 ? random() : kAllSamples);
      const PixelCoverage coverage{static_cast<float>(std::popcount(samples)) / 64.0f, samples};
      fragments.push_back(make_fragment(faces[i], static_cast<int32_t>(i), coverage, 0, 0));
    }
    auto stands = [](uint32_t solid, uint32_t strip) { return (solid + strip) % 3 == 0; };
    auto visible_by_face = [&](PixelAccumulator* sum) {
      std::vector<uint64_t> visible(faces.size());
      for (const Fragment& fragment : fragments) {
        uint64_t& of_face = visible[fragment.face];
        of_face = effective_samples(fragment.coverage);
        for (const Fragment& other : fragments) {
          of_face &=
              ~occlude_pair(fragment.coverage, other.coverage, faces[fragment.face], faces[other.face], {}, stands)
                   .of_a;
        }
        sum->add(PixelAccumulator::weight_of(fragment.coverage, of_face), faces[fragment.face].color);
      }
      return visible;
    };
    PixelAccumulator sum;
    const std::vector<uint64_t> visible = visible_by_face(&sum);
    // No sample belongs to two fragments; without cycles, each covered sample belongs to one.
    uint64_t assigned = 0, covered = 0;
    for (std::size_t i = 0; i < fragments.size(); ++i) {
      ASSERT_EQ(assigned & visible[i], 0u) << round;
      assigned |= visible[i];
      covered |= fragments[i].coverage.samples;
    }
    if (!with_strips) {
      ASSERT_EQ(assigned, covered) << round;
    }
    for (int shuffle = 0; shuffle < 5; ++shuffle) {
      std::shuffle(fragments.begin(), fragments.end(), random);
      PixelAccumulator again;
      ASSERT_EQ(visible_by_face(&again), visible) << round;
      ASSERT_EQ(again.color().r, sum.color().r) << round;
    }
  }
}

TEST(Order, AFullFragmentIsOccludedOnlyByAnother) {
  const ScreenFace near = plane_face(make_object_id(kWallKind, 0), 0.2f),
                   far = plane_face(make_object_id(kWallKind, 1), 0.1f);
  auto never = [](uint32_t, uint32_t) { return false; };
  EXPECT_EQ(occlude_pair({0.5f, 0xFFFF}, {1, kAllSamples}, near, far, {}, never).of_b, 0u);
  EXPECT_EQ(occlude_pair({1, kAllSamples}, {1, kAllSamples}, near, far, {}, never).of_b, kAllSamples);
  EXPECT_EQ(occlude_pair({0.5f, 0xFFFF}, {1, kAllSamples}, far, near, {}, never).of_a, 0xFFFFu);
}

// Random planes in one pixel, two thirds of them solids.
std::vector<ScreenFace> random_planes(std::mt19937_64* random, std::size_t count) {
  std::uniform_real_distribution<float> unit(0, 1);
  auto tilt = [&] { return 0.04f * (unit(*random) - 0.5f); };
  std::vector<ScreenFace> faces;
  for (std::size_t i = 0; i < count; ++i) {
    const uint32_t kind = i % 3 == 2 ? kStripKind : i % 3 == 1 ? kWallKind : kAgentKind;
    faces.push_back(
        plane_face(make_object_id(kind, static_cast<int32_t>(i)), 0.08f + 0.04f * unit(*random), Vec2{tilt(), tilt()}));
  }
  return faces;
}

TEST(Order, FacesBehindTheOccluderBoundAreOccluded) {
  std::mt19937_64 random(11);
  int behind = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::vector<ScreenFace> faces = random_planes(&random, 3);
    const ScreenFace& full = faces[round % 2];
    const ScreenFace& face = faces[round % 3 ? 2 : 1 - round % 2];
    const float bound = occluder_bound(full, 0, 0);
    ASSERT_EQ(bits_from_float(bound) << kOccluderBoundBits, 0u);
    ASSERT_TRUE(passes_occluder_bound(full, bound, 0, 0)) << "no face occludes itself";
    if (passes_occluder_bound(face, bound, 0, 0)) continue;
    ++behind;
    const uint64_t samples = random() | 1;
    const OccludedSamples occluded =
        occlude_pair({1, kAllSamples}, {0.5f, samples}, full, face, {}, [](uint32_t, uint32_t) { return true; });
    EXPECT_EQ(occluded.of_a, 0u);
    const Vec2 gradient{full.inverse_depth_x - face.inverse_depth_x, full.inverse_depth_y - face.inverse_depth_y};
    for (int sample = 0; sample < 64; ++sample) {
      if (!((samples & ~occluded.of_b) >> sample & 1)) continue;
      // Almost upright lines are rotated by up to this much in a pixel (see make_edge).
      const Vec2 at = centroid_of(uint64_t{1} << sample);
      const float lead = inverse_depth(full, at) - inverse_depth(face, at);
      ASSERT_GE(lead, 0.0f) << round;
      ASSERT_LT(lead, 0.5f / kSteepest * length(gradient)) << round;
    }
  }
  EXPECT_GT(behind, 2000);
}

// A device tests each face against the full face that a pixel has at that moment.
TEST(Order, TheOccluderBoundTestDoesNotDependOnTheOrder) {
  std::mt19937_64 random(12);
  for (int round = 0; round < 2000; ++round) {
    std::vector<ScreenFace> faces = random_planes(&random, 2 + random() % 8);
    if (round % 4 == 0) faces.push_back(faces.front());  // equally near
    float bound = 0;
    for (const ScreenFace& face : faces) bound = std::max(bound, occluder_bound(face, 0, 0));
    std::vector<const ScreenFace*> expected;
    for (const ScreenFace& face : faces) {
      if (passes_occluder_bound(face, bound, 0, 0)) expected.push_back(&face);
    }
    std::vector<const ScreenFace*> order;
    for (const ScreenFace& face : faces) order.push_back(&face);
    for (int shuffle = 0; shuffle < 5; ++shuffle) {
      std::shuffle(order.begin(), order.end(), random);
      std::vector<const ScreenFace*> left;
      const ScreenFace* nearest = order.front();
      for (std::size_t i = 1; i < order.size(); ++i) {
        const ScreenFace* farther = order[i];
        if (occluder_bound(*farther, 0, 0) > occluder_bound(*nearest, 0, 0)) std::swap(farther, nearest);
        if (passes_occluder_bound(*farther, occluder_bound(*nearest, 0, 0), 0, 0)) left.push_back(farther);
      }
      left.push_back(nearest);
      std::erase_if(left, [&](const ScreenFace* face) { return !passes_occluder_bound(*face, bound, 0, 0); });
      std::ranges::sort(left);
      ASSERT_EQ(left, expected) << round;
    }
  }
}

TEST(Order, ASliverIsOccludedAndDoesNotOcclude) {
  auto never = [](uint32_t, uint32_t) { return false; };
  const ScreenFace other = plane_face(make_object_id(kWallKind, 1), 0.1f);
  for (const bool sliver_in_front : {false, true}) {
    const ScreenFace sliver = plane_face(make_object_id(kWallKind, 0), sliver_in_front ? 0.2f : 0.05f);
    const OccludedSamples occluded = occlude_pair({0.01f, 0}, {0.5f, 0xFFFFFFFF}, sliver, other, {}, never);
    EXPECT_EQ(occluded.of_a, sliver_in_front ? 0u : kAllSamples);
    EXPECT_EQ(occluded.of_b, 0u);
    // Surfaces that meet in a pixel and fill it: neither occludes the other.
    EXPECT_EQ(occlude_pair({0.01f, 0}, {0.99f, kAllSamples}, sliver, other, {}, never).of_a, 0u);
    EXPECT_EQ(occlude_pair({0.99f, kAllSamples}, {0.01f, 0}, other, sliver, {}, never).of_b, 0u);
  }
}

}  // namespace
}  // namespace pictura
