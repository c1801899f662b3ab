// Painted lines as they are drawn: joined lines, duplicate paint, and agreement with the markings of whole towns.
#include "pictura/map/painted_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/common/scene.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_geometry.h"
#include "pictura/tests/support/named_maps.h"

namespace pictura {
namespace {

using Points = std::vector<Vec3>;

/// A map with markings only.
RoadMap map_of(const std::vector<PaintedLine>& lines) {
  RoadMap map;
  for (const PaintedLine& line : lines) {
    const int32_t first = static_cast<int32_t>(map.marking_points.size());
    map.marking_points.insert(map.marking_points.end(), line.points_m.begin(), line.points_m.end());
    map.markings.push_back({{first, static_cast<int32_t>(map.marking_points.size())}, line.width_m, line.color, false});
  }
  return map;
}

PaintedLine white(Points points) { return {std::move(points), 0.12f, MarkColor::white}; }

PaintedLine reversed(PaintedLine line) {
  std::reverse(line.points_m.begin(), line.points_m.end());
  return line;
}

std::vector<PaintedLine> painted(const std::vector<PaintedLine>& lines) { return painted_lines(map_of(lines)); }

bool is_at(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// Whether one of the lines has exactly these points, in either direction.
bool has_line(const std::vector<PaintedLine>& lines, const Points& points) {
  return std::any_of(lines.begin(), lines.end(), [&](const PaintedLine& line) {
    return std::equal(line.points_m.begin(), line.points_m.end(), points.begin(), points.end(), is_at) ||
           std::equal(line.points_m.begin(), line.points_m.end(), points.rbegin(), points.rend(), is_at);
  });
}

TEST(PaintedLines, ACutLineIsJoined) {
  const std::vector<PaintedLine> lines = painted(
      {white({{12, 0, 1}, {17, 0, 1}}), white({{0, 0, 1}, {9, 0, 1}, {12, 0, 1}}), white({{17, 0, 1}, {30, 0, 1}})});
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(has_line(lines, {{0, 0, 1}, {30, 0, 1}}));
  EXPECT_EQ(lines[0].width_m, 0.12f);
  EXPECT_EQ(lines[0].color, MarkColor::white);
}

TEST(PaintedLines, AreDrawnInEqualPieces) {
  const RoadMap map = map_of({white({{0, 0, 0}, {9, 0, 0}, {13, 0, 0}}), white({{13, 0, 0}, {15, 0, 0}, {24, 0, 0}})});
  const std::vector<Strip> strips = make_static_geometry(map).strips;
  ASSERT_EQ(strips.size(), 3u);
  for (const Strip& strip : strips) EXPECT_NEAR(length(strip.b_m - strip.a_m), 8, 1e-5f);
}

TEST(PaintedLines, DirectionDoesNotMatter) {
  const std::array<PaintedLine, 3> parts{white({{0, 0, 0}, {4, 1, 0}}), white({{4, 1, 0}, {8, 1.5f, 0}}),
                                         white({{8, 1.5f, 0}, {12, 1, 0}})};
  for (unsigned reversed_mask = 0; reversed_mask < 8; ++reversed_mask) {
    std::vector<PaintedLine> lines;
    for (unsigned i = 0; i < parts.size(); ++i)
      lines.push_back((reversed_mask >> i & 1) != 0 ? reversed(parts[i]) : parts[i]);
    const std::vector<PaintedLine> joined = painted(lines);
    EXPECT_EQ(joined.size(), 1u) << reversed_mask;
    EXPECT_TRUE(has_line(joined, {{0, 0, 0}, {4, 1, 0}, {8, 1.5f, 0}, {12, 1, 0}})) << reversed_mask;
  }
}

TEST(PaintedLines, PointsWithinTheToleranceAreRemoved) {
  const auto num_points = [](float lateral_m) {
    const std::vector<PaintedLine> lines =
        painted({white({{0, 0, 0}, {4, lateral_m, 0}}), white({{4, lateral_m, 0}, {8, 0, 0}})});
    return lines.at(0).points_m.size();
  };
  EXPECT_EQ(num_points(0.8f * kPaintTolerance_m), 2u);
  EXPECT_EQ(num_points(1.01f * kPaintTolerance_m), 3u);
}

TEST(PaintedLines, ACutDashIsJoinedAndGapsStayOpen) {
  const std::vector<PaintedLine> lines =
      painted({white({{0, 0, 0}, {1.2f, 0, 0}}), white({{1.2f, 0, 0}, {3, 0, 0}}), white({{12, 0, 0}, {15, 0, 0}}),
               white({{15.005f, 0, 0}, {18, 0, 0}})});
  EXPECT_EQ(lines.size(), 3u);
  EXPECT_TRUE(has_line(lines, {{0, 0, 0}, {3, 0, 0}}));
  EXPECT_TRUE(has_line(lines, {{12, 0, 0}, {15, 0, 0}}));
  EXPECT_TRUE(has_line(lines, {{15.005f, 0, 0}, {18, 0, 0}}));
}

TEST(PaintedLines, DifferentLinesAreNotJoined) {
  const PaintedLine first = white({{0, 0, 0}, {5, 0, 0}}), next = white({{5, 0, 0}, {9, 0, 0}});
  ASSERT_EQ(painted({first, next}).size(), 1u);
  PaintedLine other = next;
  other.width_m = 0.15f;
  EXPECT_EQ(painted({first, other}).size(), 2u);
  other = next;
  other.color = MarkColor::yellow;
  EXPECT_EQ(painted({first, other}).size(), 2u);
  other = next;
  for (Vec3& point : other.points_m) point.z += 0.05f;
  EXPECT_EQ(painted({first, other}).size(), 2u) << "a step in height";
  EXPECT_EQ(painted({first, white({{5, 0, 0}, {9, 2, 0}})}).size(), 2u) << "a corner";
  EXPECT_EQ(painted({first, white({{5, 0, 0}, {1, 0.1f, 0}})}).size(), 2u) << "back again";
}

TEST(PaintedLines, AtForksTheStraightestPairIsJoined) {
  const std::array<PaintedLine, 3> parts{white({{0, 0, 0}, {10, 0, 0}}), white({{10, 0, 0}, {20, 1, 0}}),
                                         white({{10, 0, 0}, {20, -0.5f, 0}})};
  std::array<std::size_t, 3> order{0, 1, 2};
  do {
    for (unsigned reversed_mask = 0; reversed_mask < 8; ++reversed_mask) {
      std::vector<PaintedLine> lines;
      for (const std::size_t i : order) lines.push_back((reversed_mask >> i & 1) != 0 ? reversed(parts[i]) : parts[i]);
      const std::vector<PaintedLine> joined = painted(lines);
      EXPECT_EQ(joined.size(), 2u);
      EXPECT_TRUE(has_line(joined, {{0, 0, 0}, {10, 0, 0}, {20, -0.5f, 0}}));
      EXPECT_TRUE(has_line(joined, {{10, 0, 0}, {20, 1, 0}}));
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

/// Among overlapping lane marks, the mark with the lower index is in front.
TEST(PaintedLines, KeepTheOrderOfTheirFirstMarkings) {
  const PaintedLine across{{{15, -5, 0}, {15, 5, 0}}, 0.12f, MarkColor::yellow};
  const PaintedLine along{{{0, 0.05f, 0}, {10, 0.05f, 0}}, 0.12f, MarkColor::blue};
  const std::vector<PaintedLine> lines =
      painted({white({{10, 0, 0}, {20, 0, 0}}), across, white({{0, 0, 0}, {10, 0, 0}}), white({{20, 0, 0}, {30, 0, 0}}),
               along});
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0].color, MarkColor::white);
  EXPECT_TRUE(is_at(lines[0].points_m.front(), {0, 0, 0}));
  EXPECT_EQ(lines[1].color, MarkColor::yellow);
  EXPECT_EQ(lines[2].color, MarkColor::blue);
}

/// A ring of three arcs, one of them reversed, whose ends do not meet exactly; and a ring of a single marking.
TEST(PaintedLines, ARingIsMitredAllRound) {
  constexpr int kCorners = 30;
  Points ring;
  for (int i = 0; i <= kCorners; ++i) {
    const float angle_rad = kTwoPi * static_cast<float>(i % kCorners) / kCorners;
    ring.push_back({8 * std::cos(angle_rad), 8 * std::sin(angle_rad), 0});
  }
  ring.back().x += 0.0005f;
  const auto part = [&](int from, int to) { return white(Points(ring.begin() + from, ring.begin() + to + 1)); };
  for (const std::vector<PaintedLine>& lines :
       {std::vector<PaintedLine>{part(0, 11), reversed(part(11, 19)), part(19, 30)},
        std::vector<PaintedLine>{part(0, 30)}}) {
    const std::vector<PaintedLine> joined = painted(lines);
    ASSERT_EQ(joined.size(), 1u);
    EXPECT_TRUE(is_at(joined[0].points_m.front(), joined[0].points_m.back()));
    const std::vector<Strip> strips = make_static_geometry(map_of(lines)).strips;
    ASSERT_EQ(strips.size(), static_cast<std::size_t>(kCorners));
    for (std::size_t i = 0; i < strips.size(); ++i) {
      const Strip& next = strips[(i + 1) % strips.size()];
      EXPECT_TRUE(is_at(strips[i].b_m, next.a_m)) << i;
      EXPECT_EQ(strips[i].side_b.x, next.side_a.x) << i;
      EXPECT_EQ(strips[i].side_b.y, next.side_a.y) << i;
    }
  }
}

TEST(PaintedLines, DuplicatePaintIsDrawnOnce) {
  const PaintedLine line = white({{0, 0, 0}, {8, 0, 0}, {14, 2, 0}, {20, 4, 0}});
  // Cut in other places, reversed, within tolerance; in both orders of length.
  const PaintedLine part = white({{17, 3, 0}, {11, 1, 0}, {8, 0.0005f, 0}, {3, 0.0005f, 0}});
  for (const std::vector<PaintedLine>& lines :
       {std::vector<PaintedLine>{line, part}, {part, line}, {line, line, part}}) {
    const std::vector<PaintedLine> unique_lines = painted(lines);
    EXPECT_EQ(unique_lines.size(), 1u);
    EXPECT_TRUE(has_line(unique_lines, {{0, 0, 0}, {8, 0, 0}, {20, 4, 0}}));
  }
}

TEST(PaintedLines, PartlyCoveredLinesAreKept) {
  const PaintedLine line = white({{0, 0, 0}, {8, 0, 0}});
  const auto count_with = [&](PaintedLine other) { return painted({line, std::move(other)}).size(); };
  ASSERT_EQ(count_with(white({{2, 0, 0}, {6, 0, 0}})), 1u);
  EXPECT_EQ(count_with(white({{2, 0.005f, 0}, {6, 0.005f, 0}})), 2u) << "next to it";
  EXPECT_EQ(count_with(white({{2, 0, 0}, {6, 0.05f, 0}})), 2u) << "at an angle";
  EXPECT_EQ(count_with(white({{6, 0, 0}, {8.05f, 0, 0}})), 2u) << "beyond its end";
  EXPECT_EQ(count_with(white({{2, 0, 5}, {6, 0, 5}})), 2u) << "above it";
  EXPECT_EQ(count_with({{{2, 0, 0}, {6, 0, 0}}, 0.2f, MarkColor::white}), 2u) << "wider";
  EXPECT_EQ(count_with({{{2, 0, 0}, {6, 0, 0}}, 0.12f, MarkColor::yellow}), 2u) << "of another colour";
  // Two dashes with a gap between them.
  std::vector<PaintedLine> dashes{white({{2.5f, 0, 0}, {6, 0, 0}}), white({{0, 0, 0}, {4, 0, 0}}),
                                  white({{4.05f, 0, 0}, {9, 0, 0}})};
  EXPECT_EQ(painted(dashes).size(), 3u);
  dashes[2].points_m[0].x = 4;
  EXPECT_EQ(painted(dashes).size(), 1u);
}

constexpr float kEdgeWidth_m = 0.15f;

TEST(PaintedLines, CoveredEdgesAreNotDrawn) {
  const auto is_drawn = [&](const std::vector<PaintedLine>& lines) {
    RoadMap map;
    map.road_edges = {{{2, 0, 1}, {10, 0, 1}}};
    return !uncovered_edges(map, lines, kEdgeWidth_m).empty();
  };
  EXPECT_TRUE(is_drawn({}));
  EXPECT_FALSE(is_drawn({white({{0, 0, 1}, {30, 0, 1}})}));
  EXPECT_FALSE(is_drawn({white({{30, 0.02f, 1}, {0, 0.02f, 1}})})) << "it extends 3.5 cm beyond the line";
  EXPECT_TRUE(is_drawn({white({{0, 0.03f, 1}, {30, 0.03f, 1}})})) << "by 4.5 cm";
  EXPECT_TRUE(is_drawn({white({{0, 0, 1}, {30, 0.3f, 1}})})) << "at an angle";
  EXPECT_TRUE(is_drawn({white({{0, 0, 2}, {30, 0, 2}})})) << "below a bridge";
  EXPECT_TRUE(is_drawn({{{{0, 0, 1}, {30, 0, 1}}, 0.05f, MarkColor::white}})) << "wider than the line";
  EXPECT_FALSE(is_drawn({{{{0, 0.1f, 1}, {30, 0.1f, 1}}, 0.35f, MarkColor::yellow}})) << "beneath a wide one's side";
  EXPECT_TRUE(is_drawn({white({{0, 0, 1}, {9, 0, 1}})})) << "not all of it";
  EXPECT_FALSE(is_drawn({white({{0, 0, 1}, {9, 0, 1}}), white({{9, 0, 1}, {12, 0.01f, 1}})})) << "beneath two";
  EXPECT_TRUE(is_drawn({white({{0, 0, 1}, {5, 0, 1}}), white({{6, 0, 1}, {12, 0, 1}})})) << "beneath dashes";
  RoadMap map;
  map.road_edges = {{{2, 0, 1}, {2.01f, 0, 1}}};
  EXPECT_EQ(uncovered_edges(map, {white({{0, 1, 1}, {30, 1, 1}})}, kEdgeWidth_m).size(), 1u) << "shorter than a gap";
}

/// Painted segments in a grid, for distance queries.
class Paint {
 public:
  explicit Paint(const std::vector<PaintedLine>& lines) {
    std::vector<Aabb2> boxes;
    for (const PaintedLine& line : lines) {
      for (std::size_t i = 1; i < line.points_m.size(); ++i) {
        const Vec3 a = line.points_m[i - 1], b = line.points_m[i];
        pieces_.push_back({a, b, line.width_m, line.color});
        boxes.push_back({{std::min(a.x, b.x) - kMaxDistance_m, std::min(a.y, b.y) - kMaxDistance_m},
                         {std::max(a.x, b.x) + kMaxDistance_m, std::max(a.y, b.y) + kMaxDistance_m}});
      }
    }
    grid_ = Grid(boxes, 10.0f);
  }

  /// Distance in metres to paint of this width and colour, at most kMaxDistance_m.
  float distance(Vec3 p, float width_m, MarkColor color) const {
    const GridView grid = grid_.view();
    if (!grid.contains(p.xy())) return kMaxDistance_m;
    const std::size_t cell = static_cast<std::size_t>(grid.cell_y(p.y) * grid.num_x + grid.cell_x(p.x));
    float distance_m = kMaxDistance_m;
    for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
      const Piece& piece = pieces_[grid.items[i]];
      if (piece.width_m != width_m || piece.color != color) continue;
      const Vec3 along = piece.b_m - piece.a_m;
      const float fraction = clamp(dot(p - piece.a_m, along) / dot(along, along), 0.0f, 1.0f);
      distance_m = std::min(distance_m, length(p - (piece.a_m + along * fraction)));
    }
    return distance_m;
  }

 private:
  static constexpr float kMaxDistance_m = 0.5f;
  struct Piece {
    Vec3 a_m, b_m;
    float width_m = 0;
    MarkColor color = MarkColor::white;
  };
  std::vector<Piece> pieces_;
  Grid grid_;
};

/// The maximum distance in metres of points on the lines from the paint.
float max_distance_from(const Paint& paint, const std::vector<PaintedLine>& lines) {
  constexpr float kStep_m = 0.25f;
  float max_distance_m = 0;
  for (const PaintedLine& line : lines) {
    for (std::size_t i = 1; i < line.points_m.size(); ++i) {
      const Vec3 a = line.points_m[i - 1], b = line.points_m[i];
      const int steps = static_cast<int>(std::ceil(length(b - a) / kStep_m));
      for (int step = 0; step <= steps; ++step) {
        const Vec3 p = a + (b - a) * (static_cast<float>(step) / static_cast<float>(steps));
        max_distance_m = std::max(max_distance_m, paint.distance(p, line.width_m, line.color));
      }
    }
  }
  return max_distance_m;
}

class PaintOfTowns : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string name = GetParam();
    if (const std::string reason = test::missing(name); !reason.empty()) GTEST_SKIP() << reason;
    map_ = load_map(name);
    drawn_ = painted_lines(*map_);
    for (const Marking& marking : map_->markings) {
      const auto begin = map_->marking_points.begin();
      markings_.push_back(
          {Points(begin + marking.points.begin, begin + marking.points.end), marking.width_m, marking.color});
    }
    ASSERT_FALSE(markings_.empty());
  }
  std::shared_ptr<const RoadMap> map_;
  std::vector<PaintedLine> drawn_, markings_;
};

INSTANTIATE_TEST_SUITE_P(All, PaintOfTowns,
                         ::testing::Values("Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07",
                                           "Town10HD", "procedural:1", "procedural:2", "procedural:5:blocks=5x4",
                                           "city:1"));

TEST_P(PaintOfTowns, MatchesTheMarkings) {
  constexpr float kRounding_m = 1e-4f;
  EXPECT_LE(max_distance_from(Paint(drawn_), markings_), kPaintTolerance_m + kRounding_m);
  EXPECT_LE(max_distance_from(Paint(markings_), drawn_), kPaintTolerance_m + kRounding_m);
}

TEST_P(PaintOfTowns, EndsWhereMarkingsEnd) {
  std::set<std::array<float, 3>> ends;
  for (const PaintedLine& line : markings_) {
    for (const Vec3 end : {line.points_m.front(), line.points_m.back()}) ends.insert({end.x, end.y, end.z});
  }
  for (const PaintedLine& line : drawn_) {
    for (const Vec3 end : {line.points_m.front(), line.points_m.back()}) {
      EXPECT_TRUE(ends.contains({end.x, end.y, end.z})) << "at " << end.x << ", " << end.y;
    }
  }
}

TEST_P(PaintOfTowns, RemovesOnlyCoveredEdges) {
  // Equal width and colour, since Paint distinguishes them.
  std::vector<PaintedLine> lines, covered;
  float widest_m = 0;
  for (const PaintedLine& line : drawn_) {
    widest_m = std::max(widest_m, line.width_m);
    lines.push_back({line.points_m, 0.0f, MarkColor::white});
  }
  const std::vector<RoadEdge> uncovered = uncovered_edges(*map_, drawn_, kEdgeWidth_m);
  std::size_t next = 0;
  for (const RoadEdge& edge : map_->road_edges) {
    if (next < uncovered.size() && is_at(uncovered[next].a_m, edge.a_m) && is_at(uncovered[next].b_m, edge.b_m)) {
      ++next;
    } else {
      covered.push_back({{edge.a_m, edge.b_m}, 0.0f, MarkColor::white});
    }
  }
  EXPECT_EQ(next, uncovered.size());
  // Tolerances beside a line, and beyond its end.
  const float lateral_m = kCoveredEdgeTolerance_m + 0.5f * (widest_m - kEdgeWidth_m),
              beyond_m = kCoveredEdgeTolerance_m;
  EXPECT_LE(max_distance_from(Paint(lines), covered), std::hypot(lateral_m, beyond_m) + 1e-3f);
  fmt::print("{}: {} edges of {}\n", GetParam(), uncovered.size(), map_->road_edges.size());
}

/// Compared with the markings cut into strips individually, without duplicates.
TEST_P(PaintOfTowns, NeedsFewerStrips) {
  std::vector<Strip> strips, drawn;
  for (const PaintedLine& line : markings_)
    append_strips(line.points_m, line.width_m, {}, StripKind::lane_mark, &strips);
  std::set<std::array<float, 7>> before;
  for (const Strip& strip : strips) {
    before.insert({strip.a_m.x, strip.a_m.y, strip.a_m.z, strip.b_m.x, strip.b_m.y, strip.b_m.z, strip.width_m});
  }
  for (const PaintedLine& line : drawn_) append_strips(line.points_m, line.width_m, {}, StripKind::lane_mark, &drawn);
  EXPECT_LT(drawn.size(), before.size());
  for (const Strip& strip : drawn) EXPECT_LE(length((strip.b_m - strip.a_m).xy()), kMaxPiece_m + 1e-4f);
  fmt::print("{}: {} strips of {}\n", GetParam(), drawn.size(), before.size());
}

}  // namespace
}  // namespace pictura
