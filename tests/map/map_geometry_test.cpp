// Static geometry: strips, heads and walls of small roads, procedural towns and CARLA towns.
#include "pictura/map/map_geometry.h"

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/tests/map/small_roads.h"
#include "pictura/tests/support/named_maps.h"

namespace pictura {
namespace {

int count_of(const StaticGeometry& geometry, StripKind kind) {
  int count = 0;
  for (const Strip& strip : geometry.strips) count += strip.kind == kind ? 1 : 0;
  return count;
}

TEST(MapGeometry, AStraightRoadHasItsMarksAndItsEdges) {
  test::RoadText road;
  road.center_mark = R"(<roadMark sOffset="0" type="solid" color="yellow" width="0.12"/>)";
  road.left = test::lane_of(1, "driving", 4);
  road.right = test::lane_of(-1, "driving", 4);
  road.rest = R"(<objects><object id="2" type="crosswalk" s="50" t="0" length="4" width="3"/></objects>)";
  const RoadMap map = parse_opendrive(test::file_of(road.text()), "small.xodr");
  const StaticGeometry geometry = make_static_geometry(map, {.walls = false});
  EXPECT_EQ(count_of(geometry, StripKind::lane_mark), 10);
  EXPECT_EQ(count_of(geometry, StripKind::road_edge), 20);  // 100 m twice: vehicles enter and leave by both ends
  EXPECT_EQ(count_of(geometry, StripKind::crosswalk), 4);
  EXPECT_EQ(count_of(geometry, StripKind::stop_line), 0);
  EXPECT_TRUE(geometry.walls.empty());
  for (const Strip& strip : geometry.strips) {
    EXPECT_LE(length(strip.b_m - strip.a_m), kMaxPiece_m + 1e-3f);
    if (strip.kind == StripKind::lane_mark) {
      EXPECT_FLOAT_EQ(strip.width_m, 0.12f);
      EXPECT_EQ(strip.color.b, kYellowMarkColor.b);
    }
  }
}

TEST(MapGeometry, DuplicateMarkingsAreDrawnOnce) {
  test::RoadText road;
  road.center_mark = R"(<roadMark sOffset="0" type="solid" color="yellow" width="0.12"/>)";
  road.right = test::lane_of(-1, "driving", 4);
  RoadMap map = test::parse(road.text());
  const std::size_t strips = make_static_geometry(map, {.walls = false}).strips.size();
  ASSERT_FALSE(map.markings.empty());
  map.markings.push_back(map.markings.front());
  EXPECT_EQ(make_static_geometry(map, {.walls = false}).strips.size(), strips);
  map.markings.back().width_m *= 2;
  EXPECT_GT(make_static_geometry(map, {.walls = false}).strips.size(), strips);
}

TEST(MapGeometry, ADuplicateCrosswalkIsDrawnOnce) {
  test::RoadText road;
  road.right = test::lane_of(-1, "driving", 4);
  road.rest = R"(<objects><object id="2" type="crosswalk" s="50" t="0" length="4" width="3"/></objects>)";
  RoadMap map = test::parse(road.text());
  ASSERT_EQ(map.crosswalks.size(), 1u);
  map.crosswalks.push_back(map.crosswalks.front());
  EXPECT_EQ(count_of(make_static_geometry(map, {.walls = false}), StripKind::crosswalk), 4);
}

TEST(MapGeometry, MarksHaveTheColourOfTheFile) {
  std::vector<float> reds;
  for (const char* color : {"white", "yellow", "red", "green", "blue", "orange", "violet", "black"}) {
    test::RoadText road;
    road.center_mark = fmt::format(R"(<roadMark sOffset="0" type="solid" color="{}"/>)", color);
    road.right = test::lane_of(-1, "driving", 4);
    const StaticGeometry geometry = make_static_geometry(test::parse(road.text()), {.walls = false});
    for (const Strip& strip : geometry.strips) {
      if (strip.kind != StripKind::lane_mark) continue;
      reds.push_back(strip.color.r);
      break;
    }
  }
  ASSERT_EQ(reds.size(), 8u);
  EXPECT_FLOAT_EQ(reds[0], kWhiteMarkColor.r);
  EXPECT_FLOAT_EQ(reds[1], kYellowMarkColor.r);
  EXPECT_GT(reds[2], 2 * reds[3]);
  EXPECT_FLOAT_EQ(reds[7], 0);
}

TEST(MapGeometry, PaintedStopLinesAreDrawnUnlessALightDrawsOne) {
  const std::string line =
      R"(<objects><object id="1" type="stopLine" s="{}" t="-3" length="0.5" width="6"/></objects>)";
  const std::string light = R"(<signals><signal id="50" type="1000001" s="1" t="-7"/></signals>)";
  for (const auto& [s, lines] : std::vector<std::pair<int, int>>{{3, 1}, {15, 2}}) {
    const RoadMap map =
        test::parse(test::three_roads(fmt::format(fmt::runtime(line), s) + light, R"(<controller id="90" type="0"/>)") +
                    R"(<controller id="90"><control signalId="50"/></controller>)");
    ASSERT_EQ(map.lights.size(), 1u);
    ASSERT_EQ(map.stop_lines.size(), 1u);
    EXPECT_EQ(count_of(make_static_geometry(map, {.walls = false}), StripKind::stop_line), lines) << s;
  }
}

TEST(MapGeometry, LightsHaveAHeadAndAStopLineEach) {
  const std::shared_ptr<const RoadMap> map = load_map("procedural:3");
  ASSERT_GT(map->lights.size(), 0u);
  const StaticGeometry geometry = make_static_geometry(*map, {.light_half_angle_rad = 1.0f});
  ASSERT_EQ(geometry.heads.size(), map->lights.size());
  EXPECT_EQ(geometry.num_signals, static_cast<int32_t>(map->lights.size()));
  for (std::size_t i = 0; i < geometry.heads.size(); ++i) {
    EXPECT_EQ(geometry.heads[i].signal, static_cast<int32_t>(i));
    EXPECT_EQ(geometry.heads[i].position_m.x, map->lights[i].head_m.x);
    EXPECT_NEAR(geometry.heads[i].cos_half_angle, std::cos(1.0f), 1e-5f);
  }
  EXPECT_GE(count_of(geometry, StripKind::stop_line), static_cast<int>(map->lights.size()));
}

class Walls : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string name = GetParam();
    if (const std::string reason = test::missing(name); !reason.empty()) GTEST_SKIP() << reason;
    map_ = load_map(name);
  }
  std::shared_ptr<const RoadMap> map_;
};

INSTANTIATE_TEST_SUITE_P(All, Walls,
                         ::testing::Values("Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07",
                                           "Town10HD", "procedural:1", "procedural:2", "city:1"));

TEST_P(Walls, DependOnTheirSeedAndLeaveGaps) {
  const std::vector<WallFace> walls = make_walls(*map_, {.wall_seed = 7}), again = make_walls(*map_, {.wall_seed = 7}),
                              other = make_walls(*map_, {.wall_seed = 8});
  ASSERT_EQ(walls.size(), again.size());
  for (std::size_t i = 0; i < walls.size(); ++i) {
    EXPECT_EQ(walls[i].a_m.x, again[i].a_m.x);
    EXPECT_EQ(walls[i].height_m, again[i].height_m);
    EXPECT_GE(walls[i].height_m, 3.0f);
    EXPECT_LE(walls[i].height_m, 12.0f);
    EXPECT_LE(length(walls[i].b_m.xy() - walls[i].a_m.xy()), kMaxPiece_m);
  }
  bool differs = walls.size() != other.size();
  for (std::size_t i = 0; i < std::min(walls.size(), other.size()); ++i) {
    differs = differs || walls[i].a_m.x != other[i].a_m.x;
  }
  EXPECT_TRUE(differs);
  EXPECT_GT(walls.size(), map_->building_lines.size() / 2);
  EXPECT_LT(walls.size(), map_->building_lines.size() * 95 / 100);
  EXPECT_TRUE(make_static_geometry(*map_, {.walls = false}).walls.empty());
  EXPECT_EQ(make_static_geometry(*map_, {.wall_seed = 7}).walls.size(), walls.size());
}

bool cross_each_other(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  const auto side = [](Vec2 from, Vec2 to, Vec2 p) { return cross(to - from, p - from) > 0; };
  return side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b);
}

/// Up to 60 m, as long as the street bends by less than 15 degrees: beyond that, a building beside it may block the
/// view. Parking lanes swing where they open, so the view along them differs from that along the street.
TEST_P(Walls, DoNotBlockTheViewAlongStreets) {
  constexpr float kViewDistance_m = 60, kBend_rad = 15 * kPi / 180;
  const std::vector<WallFace> walls = make_walls(*map_, {});
  int num_views = 0;
  for (const Lane& lane : map_->lanes) {
    if (!is_drivable(lane.type) || lane.type == LaneType::parking || lane.in_junction) continue;
    const Span<const LanePoint> points = map_->points_of(lane);
    for (std::size_t from = 0, to = 0; from < points.size(); ++from) {
      to = std::max(to, from);
      while (to + 1 < points.size() && points[to + 1].s_m <= points[from].s_m + kViewDistance_m &&
             std::abs(wrap_angle(points[to + 1].heading_rad - points[from].heading_rad)) < kBend_rad) {
        ++to;
      }
      const Vec3 eye = points[from].position_m, ahead = points[to].position_m;
      ++num_views;
      for (const WallFace& wall : walls) {
        if (std::abs(wall.a_m.z - eye.z) > 2) continue;
        ASSERT_FALSE(cross_each_other(eye.xy(), ahead.xy(), wall.a_m.xy(), wall.b_m.xy()))
            << "from " << eye.x << ", " << eye.y << " to " << ahead.x << ", " << ahead.y;
      }
    }
  }
  EXPECT_GT(num_views, 100);
}

/// Checked against lanes of every type.
TEST_P(Walls, StandOnNoLaneAndHaveTheRoadOnTheirRight) {
  ASSERT_GT(map_->building_lines.size(), 50u);
  for (const BuildingLine& line : map_->building_lines) {
    const Vec2 along = line.b_m.xy() - line.a_m.xy(), middle = (line.a_m.xy() + line.b_m.xy()) * 0.5f;
    float nearest_m = 1e9f;
    bool on_right = false;
    for (const Lane& lane : map_->lanes) {
      for (const LanePoint& point : map_->points_of(lane)) {
        for (const Vec2 point_m : {line.a_m.xy(), middle, line.b_m.xy()}) {
          const float clearance_m = length(point.position_m.xy() - point_m) - 0.5f * point.width_m;
          ASSERT_GT(clearance_m, 0.3f) << "at " << point_m.x << ", " << point_m.y;
        }
        // The road surrounds the corners of a block, so its side is determined from the middle of the line.
        const float clearance_m = length(point.position_m.xy() - middle) - 0.5f * point.width_m;
        if (clearance_m >= nearest_m) continue;
        nearest_m = clearance_m;
        on_right = cross(along, point.position_m.xy() - middle) < 0;
      }
    }
    EXPECT_TRUE(on_right) << "at " << middle.x << ", " << middle.y;
  }
}

}  // namespace
}  // namespace pictura
