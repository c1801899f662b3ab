// The rules for eight at once against those for one: equal to the bit.
#include <bit>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/backend_cpu/renderer/fast/coverage_x8.h"
#include "pictura/backend_cpu/renderer/fast/cull_x8.h"
#include "pictura/backend_cpu/renderer/fast/occlusion_x8.h"
#include "pictura/backend_cpu/renderer/fast/pairs_x8.h"
#include "pictura/bench/quality.h"
#include "pictura/common/camera.h"
#include "pictura/common/raster/check.h"
#include "pictura/common/raster/face_setup.h"

namespace pictura {
namespace {

uint32_t bits_of(float x) { return std::bit_cast<uint32_t>(x); }

// A quad, now and then with level or upright sides, of any winding that make_edges() gives it.
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

TEST(Lanes, VisitThePiecesThatMayBeVisible) {
  const Snapshot snapshot = drive_snapshot({.map = "procedural:1", .views = 8});
  const StaticGeometryView pieces = snapshot.geometry.view();
  const CulledGeometry culled(pieces);
  int visited = 0;
  for (const View& view : snapshot.views) {
    for (const PinholeCamera& in_ego : pinhole_cameras(paper_rig())) {
      const PinholeCamera camera = place_camera(in_ego, view);
      const Frustum frustum = make_frustum(camera);
      std::vector<int32_t> expected, actual;
      for_each_item(
          pieces.strip_grid, frustum_ground_box(camera, frustum),
          [&](int32_t i) { return ground_box(pieces.strips[i]); },
          [&](int32_t i) {
            if (may_be_visible(pieces.strips[i], camera, frustum)) expected.push_back(i);
          });
      culled.strips.visit_visible(camera, frustum, [&](int32_t i) { actual.push_back(i); });
      ASSERT_EQ(actual, expected);
      visited += static_cast<int>(actual.size());
    }
  }
  EXPECT_GT(visited, 1000);
}

}  // namespace
}  // namespace pictura
