// Outlines of hand-made surfaces: lengths, orientation, open ends, levels and gaps. Also a comparison with brute force
// on random bands.
#include "pictura/map/road_edges.h"

#include <cmath>

#include <gtest/gtest.h>

#include "pictura/common/rng.h"
#include "pictura/common/scene.h"

namespace pictura {
namespace {

/// A straight band from (x0, y0), `length` long, with the given heading and total width.
SurfaceBand band_of(double x0, double y0, double heading, double length, double width, double z = 0) {
  SurfaceBand band;
  const double c = std::cos(heading), s = std::sin(heading), half = 0.5 * width;
  for (int i = 0; i <= 10; ++i) {
    const double u = length * i / 10;
    band.left.emplace_back(x0 + u * c - half * s, y0 + u * s + half * c, z);
    band.right.emplace_back(x0 + u * c + half * s, y0 + u * s - half * c, z);
  }
  return band;
}

double total_length(const std::vector<RoadEdge>& edges) {
  double sum = 0;
  for (const RoadEdge& edge : edges) sum += length(edge.b_m.xy() - edge.a_m.xy());
  return sum;
}

std::vector<RoadEdge> outline(const std::vector<SurfaceBand>& bands) { return outline_of(bands, 0.02); }

double distance_to(const RoadEdge& edge, Vec2 p) {
  const Vec2 d = edge.b_m.xy() - edge.a_m.xy(), r = p - edge.a_m.xy();
  const float u = clamp(dot(r, d) / dot(d, d), 0.0f, 1.0f);
  return length(r - d * u);
}

TEST(RoadEdges, ABandIsOnTheRightOfItsOutline) {
  const std::vector<RoadEdge> edges = outline({band_of(0, 0, 0.3, 40, 4)});
  EXPECT_NEAR(total_length(edges), 88, 0.01);
  const Vec2 middle{20 * std::cos(0.3f), 20 * std::sin(0.3f)};
  for (const RoadEdge& edge : edges) {
    EXPECT_LT(cross(edge.b_m.xy() - edge.a_m.xy(), middle - edge.a_m.xy()), 0);
    EXPECT_LE(length(edge.b_m.xy() - edge.a_m.xy()), kMaxPiece_m + 1e-3f);
  }
}

TEST(RoadEdges, NeighboursShareNoEdge) {
  // Side by side, end to end, and one band twice.
  EXPECT_NEAR(total_length(outline({band_of(0, 2, 0, 40, 4), band_of(0, -2, 0, 40, 4)})), 96, 0.05);
  EXPECT_NEAR(total_length(outline({band_of(0, 2, 0, 40, 4), band_of(40, -2, M_PI, 40, 4)})), 96, 0.05);
  EXPECT_NEAR(total_length(outline({band_of(0, 0, 0, 20, 4), band_of(20, 0, 0, 20, 4)})), 88, 0.05);
  EXPECT_NEAR(total_length(outline({band_of(0, 0, 0, 40, 4), band_of(0, 0, 0, 40, 4), band_of(40, 0, M_PI, 40, 4)})),
              88, 0.05);
}

TEST(RoadEdges, AStepInWidthIsClosedOff) {
  EXPECT_NEAR(total_length(outline({band_of(0, 0, 0, 20, 4), band_of(20, 0, 0, 20, 6)})), 40 + 40 + 4 + 6 + 2, 0.1);
}

TEST(RoadEdges, ACrossingHasFourOpenMouths) {
  const std::vector<RoadEdge> edges = outline({band_of(-20, 0, 0, 40, 4), band_of(0, -20, M_PI / 2, 40, 4)});
  EXPECT_NEAR(total_length(edges), 4 * (4 + 2 * 18), 0.1);
  for (const RoadEdge& edge : edges) EXPECT_GT(distance_to(edge, {0, 0}), 2.7);
}

TEST(RoadEdges, ABridgeKeepsItsEdgesAndSoDoesTheRoadBelow) {
  EXPECT_NEAR(total_length(outline({band_of(-20, 0, 0, 40, 4), band_of(0, -20, M_PI / 2, 40, 4, 5)})), 2 * 88, 0.05);
  EXPECT_NEAR(total_length(outline({band_of(-20, 0, 0, 40, 4), band_of(0, -20, M_PI / 2, 40, 4, 1)})), 160, 0.1);
}

TEST(RoadEdges, SmallGapsAreClosedAndLargeOnesAreNot) {
  EXPECT_NEAR(total_length(outline({band_of(0, 2.01, 0, 40, 4), band_of(0, -2.01, 0, 40, 4)})), 96, 0.2);
  EXPECT_NEAR(total_length(outline({band_of(0, 2.2, 0, 40, 4), band_of(0, -2.2, 0, 40, 4)})), 176, 0.2);
}

TEST(RoadEdges, SliversAreDropped) { EXPECT_TRUE(outline({band_of(0, 0, 0, 0.06, 0.06)}).empty()); }

TEST(RoadEdges, RandomBandsHaveAnEdgeExactlyWhereTheirUnionEnds) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    RandomStream random({.seed = seed, .purpose = Purpose::town});
    struct Box {
      double x, y, heading, length, width;
      bool holds(double px, double py, double margin) const {
        const double dx = px - x, dy = py - y, c = std::cos(heading), s = std::sin(heading);
        const double u = dx * c + dy * s, v = -dx * s + dy * c;
        return u > -margin && u < length + margin && std::abs(v) < 0.5 * width + margin;
      }
    };
    std::vector<Box> boxes;
    std::vector<SurfaceBand> bands;
    for (int i = 0; i < 12; ++i) {
      boxes.push_back({random.uniform(0, 60), random.uniform(0, 60), random.uniform(-kPi, kPi), random.uniform(5, 50),
                       random.uniform(2, 8)});
      const Box& box = boxes.back();
      bands.push_back(band_of(box.x, box.y, box.heading, box.length, box.width));
    }
    auto covered = [&](double x, double y, double margin) {
      for (const Box& box : boxes) {
        if (box.holds(x, y, margin)) return true;
      }
      return false;
    };
    const std::vector<RoadEdge> edges = outline(bands);
    for (const RoadEdge& edge : edges) {
      const Vec2 along = edge.b_m.xy() - edge.a_m.xy(), middle = (edge.a_m.xy() + edge.b_m.xy()) * 0.5f;
      const Vec2 left = left_normal(along) * (1.0f / length(along));
      EXPECT_TRUE(covered(middle.x, middle.y, 0.03));
      EXPECT_FALSE(covered(middle.x + 0.03 * left.x, middle.y + 0.03 * left.y, -0.03));
    }
    // Along every side of every box: if nothing covers the ground just outside, there is an edge.
    for (const Box& box : boxes) {
      const double c = std::cos(box.heading), s = std::sin(box.heading);
      for (double u = 0.05; u < box.length; u += 0.3) {
        for (const double v : {-0.5 * box.width, 0.5 * box.width}) {
          const double outside = v + (v > 0 ? 0.1 : -0.1);
          if (covered(box.x + u * c - outside * s, box.y + u * s + outside * c, 0.0)) continue;
          const Vec2 p{static_cast<float>(box.x + u * c - v * s), static_cast<float>(box.y + u * s + v * c)};
          double nearest = 1e9;
          for (const RoadEdge& edge : edges) nearest = std::min(nearest, distance_to(edge, p));
          EXPECT_LT(nearest, 0.1) << "seed " << seed << " at " << p.x << ", " << p.y;
        }
      }
    }
  }
}

}  // namespace
}  // namespace pictura
