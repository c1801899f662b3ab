// Affine copies of maps: lanes keep their widths and connections, lengths are those of the transformed lines, and a
// name selects the same town everywhere.
#include "pictura/map/map_copy.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_fields.h"
#include "pictura/tests/map/driven_lanes.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/named_maps.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(MapCopy, NamesAreAMapAndANumber) {
  EXPECT_EQ(parse_map_copy("Town01#3").map, "Town01");
  EXPECT_EQ(parse_map_copy("Town01#3").copy, 3);
  EXPECT_EQ(parse_map_copy("procedural:7:blocks=4x3#12").map, "procedural:7:blocks=4x3");
  EXPECT_EQ(parse_map_copy("maps/a.xodr#1").copy, 1);
  EXPECT_EQ(parse_map_copy("Town01").copy, 0);
  EXPECT_EQ(parse_map_copy("a#b").map, "a#b");
  EXPECT_TRUE(is_map_file("maps/a.xodr#1"));
  EXPECT_FALSE(is_map_file("Town01#1"));
  for (const char* name : {"Town01#0", "Town01#1025", "Town01#99999999999999999999"}) {
    EXPECT_THAT(message_of<UsageError>([&] { parse_map_copy(name); }),
                AllOf(HasSubstr(name), HasSubstr("expected a copy of 1 to 1024")));
  }
  EXPECT_THAT(with_map_copies({"a", "b"}, 2), ElementsAre("a", "b", "a#1", "b#1", "a#2", "b#2"));
  EXPECT_THAT(with_map_copies({"a"}, 0), ElementsAre("a"));
}

TEST(MapCopy, RangesOfTownsAreExpanded) {
  EXPECT_THAT(
      expand_map_names({"Town01", "procedural:8-10", "procedural:3", "procedural:1-2:blocks=2x1", "procedural:4-4#2"}),
      ElementsAre("Town01", "procedural:8", "procedural:9", "procedural:10", "procedural:3", "procedural:1:blocks=2x1",
                  "procedural:2:blocks=2x1", "procedural:4#2"));
  EXPECT_THAT(expand_map_names({"city:8-9:motorway=0#1"}), ElementsAre("city:8:motorway=0#1", "city:9:motorway=0#1"));
  EXPECT_EQ(expand_map_names({"procedural:1000-1063"}).size(), 64u);
  for (const char* name : {"procedural:5-4", "procedural:0-4096", "procedural:a-4", "procedural:1-"}) {
    EXPECT_THAT(message_of<UsageError>([&] { expand_map_names({name}); }),
                AllOf(HasSubstr(name), HasSubstr("expected procedural:FIRST-LAST")));
  }
}

/// Scale, shear and rotation of a plan that is a rotation of a scaled shear along x.
struct Parts {
  double scale = 0, shear = 0, rotation = 0;
};
Parts parts_of(const PlanMap& plan) {
  const double scale = std::hypot(plan.xx, plan.yx);
  return {scale, (plan.xx * plan.xy + plan.yx * plan.yy) / (scale * scale), std::atan2(plan.yx, plan.xx)};
}

TEST(MapCopy, PlansAreDrawnFromTheirRangesByNameAndNumber) {
  double low_scale = 2, high_scale = 0, low_shear = 1, high_shear = -1, low_turn = 4, high_turn = -4;
  for (int copy = 1; copy <= 200; ++copy) {
    const PlanMap plan = draw_map_copy("Town01", copy);
    EXPECT_EQ(plan, draw_map_copy("Town01", copy));
    EXPECT_NE(plan, draw_map_copy("Town02", copy));
    EXPECT_NE(plan, draw_map_copy("Town01", copy + 1));
    const Parts parts = parts_of(plan);
    EXPECT_NEAR(plan.determinant(), parts.scale * parts.scale, 1e-9);
    low_scale = std::min(low_scale, parts.scale), high_scale = std::max(high_scale, parts.scale);
    low_shear = std::min(low_shear, parts.shear), high_shear = std::max(high_shear, parts.shear);
    low_turn = std::min(low_turn, parts.rotation), high_turn = std::max(high_turn, parts.rotation);
  }
  EXPECT_GE(low_scale, 0.85 - 1e-6);
  EXPECT_LE(high_scale, 1.2 + 1e-6);
  EXPECT_GE(low_shear, -0.1 - 1e-6);
  EXPECT_LE(high_shear, 0.1 + 1e-6);
  EXPECT_LT(low_scale, 0.87);
  EXPECT_GT(high_scale, 1.18);
  EXPECT_LT(low_shear, -0.09);
  EXPECT_GT(high_shear, 0.09);
  EXPECT_LT(low_turn, -3);
  EXPECT_GT(high_turn, 3);
}

const LanePoint& begin_of(const RoadMap& map, const Lane& lane) { return map.lane_points[lane.points.begin]; }
const LanePoint& end_of(const RoadMap& map, const Lane& lane) {
  return map.lane_points[static_cast<std::size_t>(lane.points.end) - 1];
}

bool is_straight(const RoadMap& map, const Lane& lane) {
  for (const LanePoint& point : map.points_of(lane)) {
    if (std::abs(wrap_angle(point.heading_rad - begin_of(map, lane).heading_rad)) > 1e-4f) return false;
  }
  return true;
}

/// Each of CARLA's towns and of procedural towns, and copies of each.
class Copies : public ::testing::TestWithParam<const char*> {
 protected:
  static constexpr int kCopies = 3;

  void SetUp() override {
    if (const std::string what = test::missing(GetParam()); !what.empty()) GTEST_SKIP() << what;
    original_ = load_map(GetParam());
  }

  std::shared_ptr<const RoadMap> copy(int number) const { return load_map(map_copy_name(GetParam(), number)); }

  std::shared_ptr<const RoadMap> original_;
};

INSTANTIATE_TEST_SUITE_P(All, Copies,
                         ::testing::Values("Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07",
                                           "Town10HD", "procedural:1", "procedural:5", "city:1"),
                         test::map_name);

TEST_P(Copies, KeepConnectionsWidthsHeightsAndLimits) {
  for (int number = 1; number <= kCopies; ++number) {
    const auto map = copy(number);
    EXPECT_EQ(map->name, map_copy_name(original_->name, number));
    EXPECT_EQ(map->geo_reference, "");
    ASSERT_EQ(map->lanes.size(), original_->lanes.size());
    EXPECT_EQ(map->lane_links, original_->lane_links);
    EXPECT_EQ(map->light_lanes, original_->light_lanes);
    EXPECT_EQ(map->lights.size(), original_->lights.size());
    EXPECT_EQ(map->junctions.size(), original_->junctions.size());
    EXPECT_EQ(map->crosswalks.size(), original_->crosswalks.size());
    EXPECT_EQ(map->parking_spaces.size(), original_->parking_spaces.size());
    EXPECT_EQ(map->stop_lines.size(), original_->stop_lines.size());
    double largest_gap_m = 0, largest_width_error_m = 0;
    for (std::size_t i = 0; i < map->lanes.size(); ++i) {
      const Lane &lane = map->lanes[i], &before = original_->lanes[i];
      EXPECT_EQ(lane.left_neighbor, before.left_neighbor);
      EXPECT_EQ(lane.right_neighbor, before.right_neighbor);
      EXPECT_EQ(lane.is_endless, before.is_endless);
      EXPECT_EQ(lane.speed_limit_mps, before.speed_limit_mps);
      EXPECT_EQ(begin_of(*map, lane).width_m, begin_of(*original_, before).width_m);
      EXPECT_EQ(end_of(*map, lane).width_m, end_of(*original_, before).width_m);
      EXPECT_EQ(begin_of(*map, lane).position_m.z, begin_of(*original_, before).position_m.z);
      EXPECT_EQ(end_of(*map, lane).position_m.z, end_of(*original_, before).position_m.z);
      if (lane.type != LaneType::driving) continue;
      for (const int32_t next : map->links(lane.successors)) {
        const Lane& other = map->lanes[next];
        if (other.type != LaneType::driving) continue;
        largest_gap_m =
            std::max<double>(largest_gap_m, length(begin_of(*map, other).position_m - end_of(*map, lane).position_m));
        EXPECT_LT(std::abs(wrap_angle(begin_of(*map, other).heading_rad - end_of(*map, lane).heading_rad)), 0.1);
      }
      if (lane.left_neighbor < 0) continue;
      // Widths on the ground: the centre lines of neighbours are half of both widths apart.
      const LanePoint &own = end_of(*map, lane), &next_to = end_of(*map, map->lanes[lane.left_neighbor]);
      largest_width_error_m = std::max(largest_width_error_m, std::abs(length(own.position_m - next_to.position_m) -
                                                                       0.5 * (own.width_m + next_to.width_m)));
    }
    EXPECT_LT(largest_gap_m, 0.03);
    EXPECT_LT(largest_width_error_m, 0.01);
  }
}

TEST_P(Copies, StretchStraightLanesByThePlan) {
  for (int number = 1; number <= kCopies; ++number) {
    const auto map = copy(number);
    const PlanMap plan = draw_map_copy(original_->name, number);
    int straight = 0;
    for (std::size_t i = 0; i < map->lanes.size(); ++i) {
      const Lane &lane = map->lanes[i], &before = original_->lanes[i];
      if (lane.type != LaneType::driving || lane.in_junction || before.length_m < 5 || !is_straight(*original_, before))
        continue;
      ++straight;
      const double heading = begin_of(*original_, before).heading_rad, c = std::cos(heading), s = std::sin(heading);
      const double x = plan.xx * c + plan.xy * s, y = plan.yx * c + plan.yy * s;
      EXPECT_NEAR(lane.length_m, before.length_m * std::hypot(x, y), 0.002 * before.length_m + 0.02) << i;
      EXPECT_NEAR(wrap_angle(begin_of(*map, lane).heading_rad - static_cast<float>(std::atan2(y, x))), 0, 2e-3) << i;
    }
    EXPECT_GE(straight, 20);
    const Parts parts = parts_of(plan);
    EXPECT_NEAR(map->facts.driving_lane_km / original_->facts.driving_lane_km, parts.scale, 0.06 * parts.scale);
  }
}

/// Where the tightest turns of a town have shrunk, the straight sides of a car on them may touch an edge.
TEST_P(Copies, SeldomHaveRoadEdgesWithinCarWidth) {
  for (int number = 1; number <= kCopies; ++number) {
    const test::DrivenLanes driven = test::drive_lanes(*copy(number));
    EXPECT_GT(driven.poses, 5000);
    EXPECT_LE(driven.touching, 0.0005 * driven.poses) << "copy " << number;
  }
}

/// Distance in plan from `p` to the middle of the lane.
double distance_to(const RoadMap& map, const Lane& lane, Vec2 p) {
  double nearest = 1e9;
  const Span<const LanePoint> points = map.points_of(lane);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec2 a = points[i - 1].position_m.xy(), along = points[i].position_m.xy() - a;
    const float u = clamp(dot(p - a, along) / dot(along, along), 0.0f, 1.0f);
    nearest = std::min<double>(nearest, length(p - (a + along * u)));
  }
  return nearest;
}

TEST_P(Copies, APureRotationRotatesTheMap) {
  const auto map = load_map(GetParam(), {.plan = {0, -1, 1, 0}});
  const auto rotated = [&](Vec3 p) {  // from the original's coordinates to the copy's
    const double x = p.x + original_->origin_m[0], y = p.y + original_->origin_m[1];
    return Vec3{static_cast<float>(-y - map->origin_m[0]), static_cast<float>(x - map->origin_m[1]), p.z};
  };
  ASSERT_EQ(map->lanes.size(), original_->lanes.size());
  EXPECT_EQ(map->lane_links, original_->lane_links);
  for (std::size_t i = 0; i < map->lanes.size(); ++i) {
    const Lane &lane = map->lanes[i], &before = original_->lanes[i];
    // Sampling may place points elsewhere on the same curve.
    EXPECT_NEAR(lane.length_m, before.length_m, 2e-3 * before.length_m + 1e-3) << i;
    EXPECT_LT(length(begin_of(*map, lane).position_m - rotated(begin_of(*original_, before).position_m)), 1e-3) << i;
    EXPECT_NEAR(wrap_angle(begin_of(*map, lane).heading_rad - begin_of(*original_, before).heading_rad - kPi / 2), 0,
                1e-4)
        << i;
    for (const LanePoint& point : original_->points_of(before)) {
      EXPECT_LT(distance_to(*map, lane, rotated(point.position_m).xy()), 0.03) << i;
    }
  }
  ASSERT_EQ(map->lights.size(), original_->lights.size());
  for (std::size_t i = 0; i < map->lights.size(); ++i) {
    EXPECT_LT(length(map->lights[i].stop_a_m - rotated(original_->lights[i].stop_a_m)), 2e-3);
    EXPECT_LT(length(map->lights[i].head_m - rotated(original_->lights[i].head_m)), 2e-3);
  }
  ASSERT_EQ(map->parking_spaces.size(), original_->parking_spaces.size());
  for (std::size_t i = 0; i < map->parking_spaces.size(); ++i) {
    EXPECT_LT(length(map->parking_spaces[i].center_m - rotated(original_->parking_spaces[i].center_m)), 2e-3);
    EXPECT_NEAR(map->parking_spaces[i].length_m, original_->parking_spaces[i].length_m, 1e-3);
  }
  ASSERT_EQ(map->outline_points.size(), original_->outline_points.size());
  for (std::size_t i = 0; i < map->outline_points.size(); ++i) {
    EXPECT_LT(length(map->outline_points[i] - rotated(original_->outline_points[i])), 2e-3);
  }
  EXPECT_EQ(map->building_lines.size(), original_->building_lines.size());
  EXPECT_NEAR(map->facts.driving_lane_km, original_->facts.driving_lane_km, 1e-6);
}

TEST(MapCopy, FilesAndTheirCopiesAreCachedSeparately) {
  const test::ScratchFolder folder;
  const test::EnvironmentVariable cache("XDG_CACHE_HOME", folder.path()), on("PICTURA_CACHE", std::nullopt);
  const std::string file = folder.path() + "/a.xodr";
  write_file(file, map_text("procedural:3:blocks=1x1").text);
  const auto original = load_map(file), first = load_map(file + "#1"), second = load_map(file + "#2");
  EXPECT_EQ(first->name, "a#1");
  EXPECT_NE(first_difference(*first, *second), "");
  LoadReport report;
  const auto again = load_map(file + "#1", {}, &report);
  EXPECT_TRUE(report.cached);
  EXPECT_EQ(first_difference(*first, *again), "");
  EXPECT_EQ(first_difference(*load_map(file), *original), "");
}

TEST(MapCopy, InvalidCopiesAreRefused) {
  EXPECT_THAT(message_of<UsageError>([] { map_text("procedural:3#1"); }), HasSubstr("got a copy"));
  EXPECT_THAT(message_of<UsageError>([] { load_map("Nowhere#1"); }), HasSubstr("map 'Nowhere'"));
  for (const PlanMap plan :
       {PlanMap{1, 0, 0, -1}, PlanMap{2, 0, 0, 2}, PlanMap{0.4, 0, 0, 0.4}, PlanMap{NAN, 0, 0, 1}}) {
    EXPECT_THAT(message_of<Error>([&] { load_map("procedural:3", {.plan = plan}); }), HasSubstr("expected a plan"));
  }
}

TEST(MapCopy, SeveralMapsAreLoadedInTheirOrder) {
  const std::vector<std::string> names{"procedural:3:blocks=1x1", "procedural:4:blocks=1x1#1",
                                       "procedural:4:blocks=1x1"};
  const auto maps = load_maps(names, 2);
  ASSERT_EQ(maps.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(first_difference(*maps[i], *load_map(names[i])), "");
}

}  // namespace
}  // namespace pictura
