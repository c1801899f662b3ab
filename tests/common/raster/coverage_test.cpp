// The coverage rules of common/raster compared with brute force.
#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/camera.h"
#include "pictura/common/raster/clip.h"
#include "pictura/common/raster/compositing.h"
#include "pictura/common/raster/face_setup.h"

namespace pictura {
namespace {

// A convex polygon with corners in order around a point.
std::vector<Vec2> random_polygon(std::mt19937& random, int corners) {
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<float> angles;
  for (int i = 0; i < corners; ++i) angles.push_back(kTwoPi * unit(random));
  std::sort(angles.begin(), angles.end());
  const Vec2 center{4 + 2 * unit(random), 4 + 2 * unit(random)};
  const float rx = 0.2f + 5 * unit(random), ry = 0.05f + 3 * unit(random);
  std::vector<Vec2> polygon;
  for (const float angle : angles) {
    const SinCos sc = sincos_of(angle);
    polygon.push_back({center.x + rx * sc.cos, center.y + ry * sc.sin});
  }
  return polygon;
}

std::vector<PolygonEdge> edges_of(const std::vector<Vec2>& polygon) {
  std::vector<PolygonEdge> edges;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    edges.push_back(make_edge(polygon[i], polygon[(i + 1) % polygon.size()]));
  }
  return edges;
}

// Area of a polygon within a pixel by cutting it with the pixel's four sides, in double precision.
double clipped_area(const std::vector<Vec2>& polygon, int x, int y) {
  struct P {
    double x, y;
  };
  std::vector<P> points;
  for (const Vec2& p : polygon) points.push_back({p.x, p.y});
  for (int side = 0; side < 4; ++side) {
    auto inside = [&](P p) {
      return side == 0 ? p.x - x : side == 1 ? x + 1 - p.x : side == 2 ? p.y - y : y + 1 - p.y;
    };
    std::vector<P> kept;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const P a = points[i], b = points[(i + 1) % points.size()];
      const double da = inside(a), db = inside(b);
      if (da >= 0) kept.push_back(a);
      if ((da >= 0) != (db >= 0))
        kept.push_back({a.x + (b.x - a.x) * da / (da - db), a.y + (b.y - a.y) * da / (da - db)});
    }
    points = kept;
  }
  double area = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const P a = points[i], b = points[(i + 1) % points.size()];
    area += 0.5 * (a.x * b.y - b.x * a.y);
  }
  return area;
}

// Maximum distance in px of a sample from an edge's line at which it may be assigned to the wrong side: rounding of two
// heights to kRowUnits, and the rotation of lines steeper than kSteepest.
double sample_leeway_px(Vec2 side) {
  const double dx_dy = std::abs(double{side.x} / double{side.y});
  return 2.6 / (kRowUnits * kSampleRows) + std::max(0.0, 0.5 * (1.0 / kSteepest - dx_dy));
}

// Compares pixel_coverage of a polygon in pixel (x, y) with its exact area and the samples inside.
void expect_covered(const std::vector<Vec2>& polygon, const std::vector<PolygonEdge>& edges, int x, int y) {
  const PixelCoverage coverage = pixel_coverage(edges.data(), static_cast<int>(edges.size()), kMinArea, x, y);
  const double area = clipped_area(polygon, x, y);
  constexpr double kLeeway = 1e-4;
  if (coverage.area == 1.0f) {
    ASSERT_GT(area, 1 - kFullCoverage - kLeeway);
  } else if (coverage.area == 0.0f) {
    ASSERT_LT(area, kMinArea + kLeeway);
  } else {
    ASSERT_NEAR(coverage.area, area, kLeeway);
  }
  if (area <= 2 * kMinArea) return;
  for (int sample = 0; sample < 64; ++sample) {
    const int column = sample / 8, row = sample % 8;
    const double sample_x = x + (column + 0.5) / 8, sample_y = y + (row + double{sample_column_offset(column)}) / 8;
    bool is_in = true, is_near = false;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      const double ab_x = double{b.x} - double{a.x}, ab_y = double{b.y} - double{a.y};
      const double inner = (ab_x * (sample_y - double{a.y}) - ab_y * (sample_x - double{a.x})) / std::hypot(ab_x, ab_y);
      is_near = is_near || std::abs(inner) < sample_leeway_px(b - a);
      is_in = is_in && inner > 0;
    }
    if (is_near) continue;
    ASSERT_EQ((coverage.samples >> sample) & 1, is_in ? 1u : 0u) << "sample " << sample;
  }
}

void expect_covered(const std::vector<Vec2>& polygon) {
  const std::vector<PolygonEdge> edges = edges_of(polygon);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) {
      SCOPED_TRACE(testing::Message() << "pixel " << x << ", " << y);
      ASSERT_NO_FATAL_FAILURE(expect_covered(polygon, edges, x, y));
    }
  }
}

TEST(Coverage, AreaIsExactAndSamplesInsideAreCovered) {
  std::mt19937 random(1);
  for (int round = 0; round < 400; ++round) {
    SCOPED_TRACE(round);
    ASSERT_NO_FATAL_FAILURE(expect_covered(random_polygon(random, 3 + round % 5)));
  }
}

TEST(Coverage, HoldsForTinyPolygonsAndForFarEndsOfEdges) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 4000; ++round) {
    SCOPED_TRACE(round);
    // Corners on an ellipse that has a point among the pixels; thin ellipses lie in all directions.
    const float rx = std::pow(10.0f, 5.5f * unit(random) - 2.6f), ry = std::pow(10.0f, 5.3f * unit(random) - 2.6f);
    const SinCos at = sincos_of(kTwoPi * unit(random));
    const SinCos turn = round % 2 ? sincos_of(kTwoPi * unit(random)) : SinCos{0, 1};
    auto on_ellipse = [&](SinCos sc) {
      const Vec2 p{rx * sc.cos, ry * sc.sin};
      return Vec2{p.x * turn.cos - p.y * turn.sin, p.x * turn.sin + p.y * turn.cos};
    };
    const Vec2 center = Vec2{10 * unit(random), 10 * unit(random)} - on_ellipse(at);
    std::vector<float> angles;
    for (int i = 0; i < 3 + round % 6; ++i) angles.push_back(kTwoPi * unit(random));
    std::sort(angles.begin(), angles.end());
    std::vector<Vec2> polygon;
    for (const float angle : angles) polygon.push_back(center + on_ellipse(sincos_of(angle)));
    ASSERT_NO_FATAL_FAILURE(expect_covered(polygon));
  }
}

TEST(Coverage, HoldsForSteepAndLevelEdges) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 4000; ++round) {
    SCOPED_TRACE(round);
    const float slant = round % 3 == 0 ? 0.0f : std::pow(10.0f, 7 * unit(random) - 7);
    const float width = round % 5 == 0 ? 700 * unit(random) : 4 * unit(random);
    const float height = round % 7 == 0 ? 700 * unit(random) : 4 * unit(random);
    const float x = 10 * unit(random) - (round % 2 ? width : 0), y = 10 * unit(random) - (round % 4 < 2 ? height : 0);
    auto slanting = [&] { return slant * (2 * unit(random) - 1); };
    ASSERT_NO_FATAL_FAILURE(expect_covered({{x + slanting(), y + slanting()},
                                            {x + width + slanting(), y + slanting()},
                                            {x + width + slanting(), y + height + slanting()},
                                            {x + slanting(), y + height + slanting()}}));
  }
}

TEST(Coverage, SamplesToTheSideOfAnUprightEdgeAreCountedTo64ths) {
  // Eight columns of lines alone would quantize the count to eighths of the pixel.
  for (const float lean : {0.0f, 0.02f, -0.02f}) {
    for (int step = 0; step <= 200; ++step) {
      const float x = 1 + static_cast<float>(step) / 200;
      const std::vector<PolygonEdge> edges = edges_of({{x + lean, 0}, {4, 0}, {4, 3}, {x - lean, 3}});
      const uint64_t samples = samples_inside(edges[3], 1 - edges[3].x0, 1 - edges[3].y0);
      EXPECT_NEAR(popcount(samples) / 64.0, 2 - x, 0.02) << x << ' ' << lean;
    }
  }
}

TEST(Coverage, ASharedEdgeSplitsAreaAndSamplesWithoutGapOrOverlap) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(0, 8);
  for (int round = 0; round < 2000; ++round) {
    // Two triangles on either side of the segment ab, both much larger than the tested pixels.
    const Vec2 a{unit(random), -50}, b{unit(random), 60};
    const bool level = round % 2;
    auto turned = [&](Vec2 p) { return level ? Vec2{p.y, p.x} : p; };
    const std::vector<Vec2> right{turned(a), turned({500, 3}), turned(b)},
        left{turned(b), turned({-500, 5}), turned(a)};
    auto oriented = [&](std::vector<Vec2> polygon) {
      if (level) std::reverse(polygon.begin(), polygon.end());
      return edges_of(polygon);
    };
    const auto one = oriented(right), other = oriented(left);
    for (int i = 0; i < 8; ++i) {
      const int x = level ? 4 : i, y = level ? i : 4;
      const PixelCoverage c = pixel_coverage(one.data(), 3, kMinArea, x, y),
                          d = pixel_coverage(other.data(), 3, kMinArea, x, y);
      ASSERT_EQ(c.samples & d.samples, 0u);
      if (c.area > 0 && d.area > 0) {
        ASSERT_EQ(c.samples | d.samples, kAllSamples);
        // A coverage of more than 1 - kFullCoverage is rounded to 1.
        const bool rounded = c.area == 1.0f || d.area == 1.0f;
        ASSERT_NEAR(c.area + d.area, 1, rounded ? kFullCoverage : 1e-6);
      }
    }
  }
}

TEST(Coverage, BothDirectionsOfAnEdgeHaveOppositeSigns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  int split = 0;
  for (int round = 0; round < 20000; ++round) {
    // Through the pixel or past it, in any direction; every other line is almost level or upright.
    const float exponent = round % 4 < 2 ? 0.0f : -9 * unit(random);
    const Vec2 lean = Vec2{std::pow(10.0f, exponent), 1} * (800 * unit(random)),
               way = round % 2 ? lean : Vec2{lean.y, -lean.x};
    const Vec2 a = Vec2{3 * unit(random) - 1, 3 * unit(random) - 1} - way * unit(random), b = a + way;
    const PolygonEdge one = make_edge(a, b), other = make_edge(b, a);
    const uint64_t samples = samples_inside(one, -one.x0, -one.y0);
    ASSERT_EQ(samples, ~samples_inside(other, -other.x0, -other.y0)) << round;
    split += samples != 0 && samples != kAllSamples;
    const EdgeCrossing crossing = edge_crossing(one, -one.x0, -one.y0);
    ASSERT_EQ(area_of(one, crossing, 0), -area_of(other, edge_crossing(other, -other.x0, -other.y0), 0)) << round;
  }
  EXPECT_GT(split, 4000);
}

TEST(Coverage, RowSpansAgreeWithPixels) {
  std::mt19937 random(3);
  for (int round = 0; round < 400; ++round) {
    const std::vector<PolygonEdge> edges = edges_of(random_polygon(random, 3 + round % 6));
    const int count = static_cast<int>(edges.size());
    const PixelBox box{0, 12, 0, 12};
    for (int y = 0; y < 12; ++y) {
      const RowSpan span = row_span(edges.data(), count, box, y);
      for (int x = 0; x < 12; ++x) {
        const PixelCoverage coverage = pixel_coverage(edges.data(), count, kMinArea, x, y);
        if (x < span.begin || x >= span.end) {
          ASSERT_EQ(coverage.area, 0.0f);
        }
        if (x >= span.full_begin && x < span.full_end) {
          ASSERT_EQ(coverage.area, 1.0f);
          ASSERT_EQ(coverage.samples, kAllSamples);
        }
      }
    }
  }
}

// A fragment for the composited colour, with its coverage, visible samples and colour.
struct TestFragment {
  PixelCoverage coverage;
  uint64_t visible;
  Rgb color;
};
Rgb color_of(const std::vector<TestFragment>& fragments) {
  PixelAccumulator sum;
  for (const TestFragment& fragment : fragments)
    sum.add(PixelAccumulator::weight_of(fragment.coverage, fragment.visible), fragment.color);
  return sum.color();
}

TEST(Coverage, OccludedFragmentsHaveNoWeight) {
  const Rgb color = color_of({{{1, kAllSamples}, kAllSamples, {1, 0, 0}},
                              {{1, kAllSamples}, 0, {0, 1, 0}},
                              {{0.01f, 0}, 0, {0, 1, 0}},
                              {{0.5f, 0xFFFFFFFF}, 0, {0, 1, 0}}});
  EXPECT_EQ(color.r, 1.0f);
  EXPECT_EQ(color.g, 0.0f);
}

TEST(Coverage, TwoFacesOfOneThirdAndTwoThirdsFillAPixel) {
  const uint64_t third = 0xFFFFFFull;  // any split of the samples
  EXPECT_NEAR(color_of({{{1.0f / 3, third}, third, {1, 1, 1}}, {{2.0f / 3, ~third}, ~third, {1, 1, 1}}}).r, 1, 2e-6);
}

TEST(Coverage, AFullFragmentGetsTheRemainingWeight) {
  // In front, a quarter of the area although 20 of 64 samples; behind it, a partly occluded fragment, weighted by
  // samples; then a wall.
  const uint64_t front = (1ull << 20) - 1, middle = (1ull << 40) - 1;
  const Rgb color = color_of({{{0.25f, front}, front, {1, 0, 0}},
                              {{0.5f, middle}, middle & ~front, {0, 1, 0}},
                              {{1, kAllSamples}, kAllSamples, {0, 0, 1}}});
  EXPECT_NEAR(color.r, 0.25f, 2e-6f);
  EXPECT_NEAR(color.g, 0.5f * 20 / 40, 2e-6f);
  EXPECT_NEAR(color.b, 0.5f, 2e-6f);
}

TEST(Coverage, AFullFragmentGetsAreaWithoutSamples) {
  // Two faces that cover all samples but not all of the area.
  const uint64_t half = 0xFFFFFFFFull;
  const Rgb color = color_of({{{0.48f, half}, half, {1, 0, 0}},
                              {{0.5f, ~half}, ~half, {0, 1, 0}},
                              {{1, kAllSamples}, kAllSamples, {0, 0, 1}},
                              {{1, kAllSamples}, 0, {1, 1, 1}}});
  EXPECT_NEAR(color.r, 0.48f, 2e-6f);
  EXPECT_NEAR(color.b, 0.02f, 2e-6f);
}

TEST(Coverage, WeightsNeverExceedThePixel) {
  const uint64_t half = 0xFFFFFFFFull;
  const Rgb color = color_of({{{0.6f, half}, half, {1, 0, 0}}, {{0.9f, kAllSamples}, ~half, {0, 1, 0}}});
  EXPECT_NEAR(color.r, 0.6f, 2e-6f);
  EXPECT_NEAR(color.g, 0.4f, 2e-6f);
}

TEST(Coverage, IgnoresStripsBelowTheirMinimumArea) {
  const PrimitiveRef strip{kStripKind << kKindShift, 0}, wall = wall_ref(0);
  const Rgb white{0.9f, 0.88f, 0.85f};
  for (const float brightness : {1.0f, 0.5f, 0.15f}) {
    const Rgb color = white * brightness;
    EXPECT_NEAR(min_area_of(color, strip) * color.r, kMinWeight, 1e-7f) << brightness;
    EXPECT_EQ(min_area_of(color, wall), kMinArea);
  }
  // A dark strip may occlude a bright one, so its minimum area is bounded.
  EXPECT_FLOAT_EQ(min_area_of(white * 0.01f, strip), kMaxSparedArea);
  EXPECT_FLOAT_EQ(min_area_of({}, strip), kMaxSparedArea);
  const float min_area = kMinWeight / white.r;
  for (const float area : {0.9f * min_area, 1.1f * min_area}) {
    const std::vector<PolygonEdge> edges = edges_of({{2, 1}, {3, 1}, {3, 1 + area}, {2, 1 + area}});
    const PixelCoverage coverage = pixel_coverage(edges.data(), 4, min_area_of(white, strip), 2, 1);
    if (area < min_area) {
      EXPECT_EQ(coverage.area, 0.0f);
    } else {
      EXPECT_NEAR(coverage.area, area, 1e-6f);
    }
  }
}

TEST(Coverage, ClippingKeepsThePartInFront) {
  Rig rig = paper_rig();
  PinholeCamera camera;
  camera.right = {1, 0, 0};
  camera.down = {0, 1, 0};
  camera.forward = {0, 0, 1};
  camera.focal_x_px = camera.focal_y_px = 50;
  camera.center_x_px = camera.center_y_px = 50;
  camera.width_px = camera.height_px = 100;
  const Frustum frustum = make_frustum(camera);
  Vec3 polygon[kMaxPolygonCorners];
  // A floor from behind the camera to 10 m ahead, 1 m below: cut at the bottom of the guard band, y = 58/50 of the
  // depth.
  const Vec3 floor[4] = {{-0.5f, 1, -5}, {0.5f, 1, -5}, {0.5f, 1, 10}, {-0.5f, 1, 10}};
  const int count = clip_face(frustum, floor, 4, polygon);
  ASSERT_EQ(count, 4);
  float nearest = 1e9f;
  for (int i = 0; i < count; ++i) nearest = std::min(nearest, polygon[i].z);
  EXPECT_NEAR(nearest, 50.0f / 58.0f, 1e-5);
  const Vec3 behind[3] = {{0, 0, -1}, {1, 0, -1}, {0, 1, 0.05f}};
  EXPECT_EQ(clip_face(frustum, behind, 3, polygon), 0);
}

}  // namespace
}  // namespace pictura
