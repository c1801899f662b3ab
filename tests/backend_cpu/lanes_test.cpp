// Rules for eight SIMD lanes give results that are bitwise identical to those of the scalar rules.
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/backend_cpu/renderer/fast/coverage_x8.h"
#include "pictura/backend_cpu/renderer/fast/cull_x8.h"
#include "pictura/backend_cpu/renderer/fast/occlusion_x8.h"
#include "pictura/backend_cpu/renderer/fast/pairs_x8.h"
#include "pictura/backend_cpu/renderer/fast/strips_x8.h"
#include "pictura/bench/quality.h"
#include "pictura/common/camera.h"
#include "pictura/common/raster/check.h"
#include "pictura/common/raster/face_setup.h"
#include "pictura/common/rng.h"

namespace pictura {
namespace {

uint32_t bits_of(float x) { return std::bit_cast<uint32_t>(x); }

// Returns a quad, sometimes with level or upright sides, of any winding that make_edges() accepts.
std::vector<PolygonEdge> random_quad(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(0, 1);
  const Vec2 center{2 + 12 * unit(random), 2 + 12 * unit(random)}, half{6 * unit(random), 4 * unit(random)};
  const float lean = random() % 4 == 0 ? 0.0f : unit(random) - 0.5f;
  const Vec2 corner[4] = {{center.x - half.x, center.y - half.y - lean},
                          {center.x + half.x, center.y - half.y + lean},
                          {center.x + half.x + lean, center.y + half.y},
                          {center.x - half.x - lean, center.y + half.y}};
  std::vector<PolygonEdge> edges;
  make_edges(corner, 4, true, [&](int, const PolygonEdge& edge) { edges.push_back(edge); });
  return edges;
}

TEST(Lanes, HaveTheSpansAndCoverageOfRows) {
  std::mt19937 random(1);
  constexpr PixelBox kBox{0, 16, 0, 16};
  for (int round = 0; round < 500; ++round) {
    const std::vector<PolygonEdge> edges = random_quad(random);
    const int count = static_cast<int>(edges.size());
    for (const int y_begin : {0, 8}) {
      const RowSpansX8 spans = row_spans_x8(edges.data(), count, kBox, y_begin);
      for (int lane = 0; lane < kLanes; ++lane) {
        const RowSpan span = row_span(edges.data(), count, kBox, y_begin + lane);
        ASSERT_EQ(spans.begin[lane], span.begin) << round;
        ASSERT_EQ(spans.end[lane], span.end) << round;
        ASSERT_EQ(spans.full_begin[lane], span.full_begin) << round;
        ASSERT_EQ(spans.full_end[lane], span.full_end) << round;
      }
      for (int x_begin = 0; x_begin < 16; x_begin += 4) {
        int32_t x[kLanes], y[kLanes];
        for (int lane = 0; lane < kLanes; ++lane) {
          x[lane] = x_begin + lane % 4;
          y[lane] = y_begin + lane;
        }
        PixelCoverage lanes[kLanes];
        coverage_x8(edges.data(), count, kMinArea, x, y, kLanes,
                    [&](int lane, const PixelCoverage& coverage) { lanes[lane] = coverage; });
        for (int lane = 0; lane < kLanes; ++lane) {
          const PixelCoverage one = pixel_coverage(edges.data(), count, kMinArea, x[lane], y[lane]);
          ASSERT_EQ(bits_of(lanes[lane].area), bits_of(one.area)) << round;
          ASSERT_EQ(lanes[lane].samples, one.samples) << round;
        }
      }
    }
  }
}

TEST(Lanes, HaveTheOrderAndBoundsOfFaces) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(0, 1);
  int undecided = 0;
  for (int round = 0; round < 500; ++round) {
    ScreenFace face[2 * kLanes];
    PairsX8 pairs;
    for (int i = 0; i < 2 * kLanes; ++i) {
      const float depth = 0.05f + 0.02f * unit(random);
      face[i].object_id =
          make_object_id(random() % 3 == 0 ? kAgentKind : kStripKind, static_cast<int32_t>(random() % 99));
      face[i].inverse_depth_0 = depth;
      face[i].inverse_depth_x = 0.001f * (unit(random) - 0.5f);
      face[i].inverse_depth_y = 0.001f * (unit(random) - 0.5f);
      face[i].inverse_depth_low = 0.9f * depth;
      face[i].inverse_depth_high = 1.1f * depth;
      face[i].plane_distance_m = is_strip(face[i]) ? 2.0f * unit(random) - 1.5f : 0.0f;
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      pairs.a[lane] = &face[lane];
      pairs.b[lane] = &face[kLanes + lane];
      pairs.shared[lane] = ((uint64_t{random()} << 32 | random()) & (uint64_t{random()} << 32 | random())) | 1;
      pairs.x[lane] = static_cast<float>(lane);
      pairs.y[lane] = static_cast<float>(round % 7);
      float bound[kLanes];
      store8(occluder_bound_x8(face[0], 3, round % 7), bound);
      ASSERT_EQ(bits_of(bound[lane]),
                bits_of(is_strip(face[0]) ? bound[lane] : occluder_bound(face[0], 3 + lane, round % 7)));
      ASSERT_EQ(passes_occluder_bound_x8(face[1], bound, 3, round % 7) >> lane & 1,
                passes_occluder_bound(face[1], bound[lane], 3 + lane, round % 7) ? 1u : 0u);
    }
    const Vec2x8 centroid = centroid_of_x8(pairs.shared);
    const PairOrder order = order_pairs(pairs);
    for (int lane = 0; lane < kLanes; ++lane) {
      const Vec2 one = centroid_of(pairs.shared[lane]);
      ASSERT_EQ(bits_of(centroid.x[lane]), bits_of(one.x));
      ASSERT_EQ(bits_of(centroid.y[lane]), bits_of(one.y));
      if ((order.undecided >> lane & 1) != 0) {
        ++undecided;
        continue;
      }
      const uint64_t a_first =
          samples_in_front(*pairs.a[lane], *pairs.b[lane], pairs.shared[lane], {pairs.x[lane], pairs.y[lane]}, false,
                           [](uint32_t, uint32_t) { return true; });
      ASSERT_EQ(a_first, (order.a_first >> lane & 1) != 0 ? pairs.shared[lane] : 0) << round;
    }
  }
  EXPECT_GT(undecided, 0);
  EXPECT_LT(undecided, 2000);
}

// Calls visit(camera) for each camera of each view.
template <typename Visit>
void visit_cameras(const Snapshot& snapshot, Visit&& visit) {
  for (const View& view : snapshot.views) {
    for (const PinholeCamera& in_ego : pinhole_cameras(paper_rig())) visit(place_camera(in_ego, view));
  }
}

TEST(Lanes, VisitThePiecesThatMayBeVisible) {
  const Snapshot snapshot = drive_snapshot({.map = "procedural:1", .views = 8});
  const StaticGeometryView pieces = snapshot.geometry.view();
  const CulledGeometry culled(pieces);
  // Compares the visited items and returns their number.
  auto compare = [](const BallGrid& balls, const GridView& grid, const auto& items, const PinholeCamera& camera) {
    const Frustum frustum = make_frustum(camera);
    std::vector<int32_t> expected, actual;
    for_each_item(
        grid, frustum_ground_box(camera, frustum), [&](int32_t i) { return ground_box(items[i]); },
        [&](int32_t i) {
          if (may_be_visible(items[i], camera, frustum)) expected.push_back(i);
        });
    balls.visit_visible(camera, frustum, frustum_ground_box(camera, frustum), [&](int32_t i) { actual.push_back(i); });
    EXPECT_EQ(actual, expected);
    return actual.size();
  };
  std::size_t strips = 0, walls = 0;
  visit_cameras(snapshot, [&](const PinholeCamera& camera) {
    strips += compare(culled.strips, pieces.strip_grid, pieces.strips, camera);
    walls += compare(culled.walls, pieces.wall_grid, pieces.walls, camera);
  });
  EXPECT_GT(strips, 1000u);
  EXPECT_GT(walls, 100u);
}

// Draws a place near the middle, on the border of a cell, or anywhere from there to far outside any map.
Vec3 draw_place(RandomStream* random_inout) {
  const float kind = random_inout->uniform();
  const float reach_m = kind < 0.6f ? 150.0f : kind < 0.95f ? 600.0f : kind < 0.98f ? 1e5f : 1e8f;
  Vec3 p{random_inout->uniform(-reach_m, reach_m), random_inout->uniform(-reach_m, reach_m),
         random_inout->uniform(-10, 20)};
  if (random_inout->uniform() < 0.2f) p.x = 16.0f * std::floor(p.x / 16.0f);
  if (random_inout->uniform() < 0.2f) p.y = 16.0f * std::floor(p.y / 16.0f);
  return p;
}

TEST(Lanes, FindTheBoxesAndHeadsThatMayBeVisible) {
  RandomStream random({.seed = 7, .purpose = Purpose::town});
  std::size_t boxes_seen = 0, heads_seen = 0;
  for (const int size : {0, 1, 300, 3000}) {
    for (const float longest_m : {6.0f, 90.0f}) {
      std::vector<AgentBox> boxes;
      StaticGeometry geometry;
      for (int i = 0; i < size; ++i) {
        const bool is_long = random.uniform() < 0.01f;
        boxes.push_back(make_box(AgentClass::vehicle, draw_place(&random), random.uniform(-3, 3),
                                 {is_long ? longest_m : random.uniform(0, 5), random.uniform(0, 3), 1.5f}));
        boxes.back().drawn = random.uniform() < 0.9f;
        geometry.heads.push_back({draw_place(&random), {1, 0}});
      }
      geometry.build_grids();
      const Crowd crowd(boxes);
      const CulledGeometry culled(geometry.view());
      for (int round = 0; round < 100; ++round) {
        const Vec3 at = draw_place(&random);
        const View view = make_view({at.x, at.y, 0}, random.uniform(-3, 3));
        for (const PinholeCamera& in_ego : pinhole_cameras(paper_rig())) {
          const PinholeCamera camera = place_camera(in_ego, view);
          const Frustum frustum = make_frustum(camera);
          const auto expected = [&](const auto& items) {
            std::vector<int32_t> visible;
            for (std::size_t i = 0; i < items.size(); ++i) {
              if (may_be_visible(items[i], camera, frustum)) visible.push_back(static_cast<int32_t>(i));
            }
            return visible;
          };
          std::vector<int32_t> found;
          crowd.find_visible(camera, frustum, &found);
          ASSERT_EQ(found, expected(boxes)) << size;
          boxes_seen += found.size();
          culled.heads.find_visible(camera, frustum, &found);
          ASSERT_EQ(found, expected(geometry.heads)) << size;
          heads_seen += found.size();
        }
      }
    }
  }
  EXPECT_GT(boxes_seen, 10000u);
  EXPECT_GT(heads_seen, 10000u);
}

// Returns an upright face before the camera that fills the middle of its image.
Occluder occluder_before(const ImageSetting& setting) {
  CameraQuad face{{{-4, -2, 12}, {4, -2, 12}, {4, 2, 12}, {-4, 2, 12}}, {}, {}};
  face.plane = quad_plane(face.corner);
  ScreenQuad quad;
  bool is_clockwise = false;
  EXPECT_GT(occluder_area_px2(setting.camera, face, &quad, &is_clockwise), 0.0f);
  return make_occluder(setting.camera, setting.frustum, face.plane, quad, is_clockwise);
}

// Returns the bits of a strip's drawing inputs.
std::vector<uint32_t> bits_of_strip(const ScreenQuad& quad, const FacePlane& plane, Rgb color, bool is_clockwise) {
  std::vector<uint32_t> bits;
  for (const Vec2 corner : quad.corner) bits.insert(bits.end(), {bits_of(corner.x), bits_of(corner.y)});
  const ScreenBounds& bounds = quad.bounds;
  for (const float of : {bounds.low.x, bounds.low.y, bounds.high.x, bounds.high.y, bounds.inverse_depth_low,
                         bounds.inverse_depth_high, plane.normal.x, plane.normal.y, plane.normal.z, plane.offset,
                         color.r, color.g, color.b, is_clockwise ? 1.0f : 0.0f}) {
    bits.push_back(bits_of(of));
  }
  return bits;
}

TEST(Lanes, SetUpStripsAsTheScalarCodeDoes) {
  const Snapshot snapshot = drive_snapshot({.map = "procedural:1", .views = 8});
  const StaticGeometryView pieces = snapshot.geometry.view();
  const CulledGeometry culled(pieces);
  int visible = 0, crossing = 0, occluded = 0, from_below = 0;
  auto compare = [&](const ImageSetting& setting, const Strip* const* strip, const int32_t* index) {
    const StripsX8 lanes = set_up_strips(setting, strip);
    for (int lane = 0; lane < kLanes; ++lane) {
      CameraQuad in_camera;
      ScreenQuad quad;
      bool is_clockwise = false;
      ClipClass clip_class = ClipClass::outside;
      if (quad_to_camera(strip_quad(*strip[lane]), setting.camera, &in_camera)) {
        clip_class = project_quad(setting.camera, in_camera.corner, setting.line_floor_px, &quad);
      }
      auto is_visible = [&](const ImageSetting& under) {
        return is_quad_visible(under, quad, in_camera.plane, in_camera.color, strip_ref(*strip[lane], index[lane]),
                               &is_clockwise);
      };
      const bool is_inside = clip_class == ClipClass::inside, is_seen = is_inside && is_visible(setting);
      ASSERT_EQ((lanes.crossing >> lane & 1) != 0, clip_class == ClipClass::crossing) << index[lane];
      ASSERT_EQ((lanes.visible >> lane & 1) != 0, is_seen) << index[lane];
      crossing += clip_class == ClipClass::crossing ? 1 : 0;
      if (is_seen) {
        ASSERT_EQ(bits_of_strip(lanes.quad(lane), lanes.plane(lane), lanes.color_of(lane),
                                (lanes.clockwise >> lane & 1) != 0),
                  bits_of_strip(quad, in_camera.plane, in_camera.color, is_clockwise))
            << index[lane];
        ++visible;
        from_below += in_camera.plane.offset > 0.0f ? 1 : 0;
      } else if (is_inside) {
        ImageSetting alone = setting;
        alone.occluders.count = 0;
        occluded += is_visible(alone) ? 1 : 0;
      }
    }
  };
  visit_cameras(snapshot, [&](PinholeCamera camera) {
    for (const float below_m : {0.0f, 3.0f}) {
      camera.position_m.z -= below_m;
      for (const float line_floor_px : {0.0f, 1.0f}) {
        ImageSetting setting{camera, make_frustum(camera), line_floor_px};
        setting.occluders.occluder[0] = occluder_before(setting);
        setting.occluders.count = 1;
        std::vector<int32_t> index;
        culled.strips.visit_visible(camera, setting.frustum, frustum_ground_box(camera, setting.frustum),
                                    [&](int32_t i) { index.push_back(i); });
        for (std::size_t begin = 0; begin + kLanes <= index.size(); begin += kLanes) {
          const Strip* strip[kLanes];
          for (int lane = 0; lane < kLanes; ++lane) strip[lane] = &pieces.strips[index[begin + lane]];
          compare(setting, strip, &index[begin]);
        }
      }
    }
  });
  EXPECT_GT(visible, 1000);
  EXPECT_GT(crossing, 100);
  EXPECT_GT(occluded, 100);
  EXPECT_GT(from_below, 100);
}

}  // namespace
}  // namespace pictura
