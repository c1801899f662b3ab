// The probe of a tracked pedestrian: paths that it finds, controls that could fail, and means.
#include "pictura/evaluation/probes/pedestrian.h"

#include <cmath>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "pictura/evaluation/probes/crossing_path.h"
#include "pictura/policy/session.h"
#include "pictura/tests/evaluation/probed_policies.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::kAgent;
using test::kLikeForLike;
using test::kVectorized;
using test::message_of;
using test::read_table;
using ::testing::HasSubstr;

// ---- paths

constexpr int kMetre = static_cast<int>(1 / kPathSpacing_m);

AgentBox car(Vec2 center_m) {
  return {.center_m = {center_m.x, center_m.y, 0}, .length_m = 4, .width_m = 2, .height_m = 1.5f};
}

TEST(CrossingPaths, BeginBehindTheVehicle) {
  const std::vector<CrossingPath> paths = paths_behind(car({20, 0}), {0, 0});
  ASSERT_EQ(paths.size(), 6u);
  std::set<int> degrees;
  for (const CrossingPath& path : paths) {
    EXPECT_NEAR(path.origin_m.x, 20 + 2 + 0.8, 1e-4);
    EXPECT_NEAR(path.origin_m.y, 0, 1e-4);
    EXPECT_NEAR(length(path.direction), 1, 1e-5);
    degrees.insert(static_cast<int>(std::lround(std::atan2(path.direction.y, path.direction.x) * 180 / 3.14159265)));
    EXPECT_NEAR(length(path.point_m(kPathOrigin + 2 * kMetre) - path.origin_m), 2, 1e-4);
    EXPECT_EQ(path.pedestrian(3, 1.2f).box.agent_class, AgentClass::pedestrian);
  }
  EXPECT_EQ(degrees, (std::set<int>{-120, -90, -60, 60, 90, 120}));
  EXPECT_NEAR(paths_behind(car({0, 20}), {0, 0})[0].origin_m.y, 20 + 1 + 0.8, 1e-4) << "from its side it is narrow";
  EXPECT_TRUE(paths_behind(car({0, 0}), {0, 0}).empty());
}

TEST(CrossingPaths, PedestriansOverlapNoBoxAndNoWall) {
  const CrossingPath path{{0, 0}, {0, 1}, 0};
  AgentBox other = car({0, 10}), above = car({0, 20}), absent = car({0, 25});
  above.center_m.z = 6;
  absent.drawn = 0;
  const WallFace wall{{-5, 5, 0}, {5, 5, 0}, 3}, far_wall{{3, -50, 0}, {3, 50, 0}, 3};
  const std::vector<bool> is_free = free_points(path, std::vector{other, above, absent}, std::vector{wall, far_wall});
  ASSERT_EQ(is_free.size(), static_cast<size_t>(kPathPoints));
  for (int i = 0; i < kPathPoints; ++i) {
    const float y_m = path.point_m(i).y;
    EXPECT_EQ(is_free[i], std::abs(y_m - 10) >= 1.36f && std::abs(y_m - 5) >= 0.36f) << y_m;
  }
}

TEST(CrossingPaths, AreHiddenThenVisibleThenHidden) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  // Hidden from 3 m before the origin to 1 m behind it, seen for 5 m, hidden for 12 m.
  std::vector<float> shares(kPathPoints, 0.5f);
  const auto fill = [&shares](int from, int to, float share) {
    for (int i = from; i < to; ++i) shares[i] = share;
  };
  const int begin = kPathOrigin - 3 * kMetre, seen = kPathOrigin + kMetre, again = seen + 5 * kMetre;
  fill(begin, seen, 0);
  fill(seen, again, 1);
  fill(again, again + 12 * kMetre, 0);
  const auto part = usable_part(shares);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->begin, begin);
  EXPECT_EQ(part->first_seen, seen);
  EXPECT_EQ(part->hidden_again, again);
  EXPECT_EQ(part->end, again + 8 * kMetre) << "no more than 8 m of it";
  const auto with = [&shares](int i, float share) {
    std::vector<float> others = shares;
    others[i] = share;
    return usable_part(others);
  };
  EXPECT_FALSE(with(kPathOrigin, 0.1f)) << "not hidden at its origin";
  EXPECT_FALSE(with(kPathOrigin - 1, 0.1f)) << "too short a time before it is seen";
  EXPECT_FALSE(with(seen + 2, nan)) << "nobody can walk on";
  EXPECT_FALSE(with(seen + 2, 0)) << "too short a glance";
  EXPECT_FALSE(with(again + 2, 0.1f)) << "too short a time after it is seen";
  fill(seen, again, 0.8f);
  EXPECT_FALSE(usable_part(shares)) << "never seen whole";
  EXPECT_FALSE(usable_part(std::vector<float>(kPathPoints, 0))) << "never seen";
}

// ---- the probe

struct PedestrianKind {
  using Options = PedestrianOptions;
  using Results = PedestrianResults;
  static constexpr int64_t kCases = 6;
  static void set_cases(int64_t paths, PedestrianOptions* options) {
    options->worlds.scenarios = 3;
    options->paths = paths;
    options->min_speed_mps = -10;  // allows reversing
  }
  static PedestrianResults probe(const PedestrianOptions& options) { return probe_pedestrian(options); }
  static bool is_same(const PedestrianResults& a, const PedestrianResults& b) { return test::same_bits(a, b); }
};
using Pedestrian = test::ProbeTest<PedestrianKind>;

TEST_F(Pedestrian, PathsAreFoundInAllScenes) {
  const PedestrianResults& all = results();
  ASSERT_EQ(all.paths.size(), 6u);
  ASSERT_EQ(all.responses.size(), 3 * all.points.size());
  std::map<int, int> of_scene;
  std::set<std::tuple<int, int, int>> states;
  int32_t next = 0;
  for (const PedestrianPath& path : all.paths) {
    ++of_scene[path.scene];
    EXPECT_TRUE(states.insert({path.scene, path.step, path.ego}).second) << "a state serves an ego once";
    EXPECT_EQ(path.driver, path.scene - 3);
    EXPECT_EQ(path.map, path.scene % 2);
    EXPECT_EQ(path.step % 4, 0);
    EXPECT_LE(path.hider_distance_m, 30);
    EXPECT_EQ(path.boxes[path.hider].agent_class, AgentClass::vehicle);
    EXPECT_EQ(path.first_point, next);
    next += path.num_points;
    std::set<PathPhase> phases;
    for (int32_t i = path.first_point; i < next; ++i) {
      const PedestrianPoint& point = all.points[i];
      EXPECT_EQ(&all.paths[point.path], &path);
      EXPECT_EQ(point.along_m, kPathSpacing_m * static_cast<float>(i - path.first_point));
      EXPECT_EQ(point.visible_share > 0, path.phase_of(i) == PathPhase::seen);
      phases.insert(path.phase_of(i));
    }
    EXPECT_EQ(phases.size(), 3u);
  }
  EXPECT_EQ(next, static_cast<int32_t>(all.points.size()));
  ASSERT_EQ(of_scene.size(), 3u);
  for (const auto& [scene, count] : of_scene) EXPECT_EQ(count, 2) << scene;
}

TEST_F(Pedestrian, HiddenPedestriansChangeNothingForCamerasAndMuchForVectors) {
  const PedestrianResults& all = results();
  int hidden = 0, near = 0, near_changes = 0;
  std::array<int, 3> hidden_changes{};
  for (size_t i = 0; i < all.points.size(); ++i) {
    const PedestrianPoint& point = all.points[i];
    if (point.visible_share == 0) {
      ++hidden;
      for (const size_t policy : {kAgent, kVectorized, kLikeForLike})
        hidden_changes[policy] += !all.response(i, policy).is_unchanged();
    } else if (point.visible_share > 0.5f && point.distance_m < 20) {
      ++near;
      near_changes += !all.response(i, kAgent).is_unchanged();
    }
  }
  ASSERT_GT(hidden, 60);
  EXPECT_EQ(hidden_changes[kAgent], 0) << "an untrained policy's curve is zero there, too";
  EXPECT_GT(hidden_changes[kVectorized], hidden / 4);
  EXPECT_GT(hidden_changes[kLikeForLike], hidden / 4);
  ASSERT_GT(near, 10);
  EXPECT_GT(near_changes, near * 9 / 10);
}

TEST_F(Pedestrian, AnAbsentPedestrianChangesNothing) {
  const PedestrianResults control = controlled(PedestrianControl::unchanged);
  ASSERT_EQ(control.points.size(), results().points.size());
  for (size_t i = 0; i < control.responses.size(); ++i) {
    EXPECT_TRUE(control.responses[i].is_unchanged()) << i;
    EXPECT_EQ(control.responses[i].value_without, results().responses[i].value_without) << "the states are the same";
  }
}

TEST_F(Pedestrian, UntrainedPoliciesAreEvaluatedOnTheSamePaths) {
  const PedestrianResults control = controlled(PedestrianControl::untrained);
  const PedestrianResults& all = results();
  ASSERT_EQ(control.points.size(), all.points.size());
  std::array<int, 3> differ{};
  int hidden_changes = 0, seen_changes = 0;
  for (size_t i = 0; i < control.points.size(); ++i) {
    EXPECT_EQ(control.points[i].visible_share, all.points[i].visible_share);
    EXPECT_EQ(control.points[i].pedestrian.center_m.x, all.points[i].pedestrian.center_m.x);
    for (const size_t policy : {kAgent, kVectorized, kLikeForLike})
      differ[policy] += control.response(i, policy).value != all.response(i, policy).value;
    const bool is_changed = !control.response(i, kAgent).is_unchanged();
    (control.points[i].visible_share == 0 ? hidden_changes : seen_changes) += is_changed;
  }
  for (const int count : differ) EXPECT_GT(count, static_cast<int>(all.points.size()) * 9 / 10);
  EXPECT_EQ(hidden_changes, 0);
  EXPECT_GT(seen_changes, 10);
}

TEST_F(Pedestrian, BatchSizeDoesNotChangeResults) { expect_the_same_of_batches({1, 300}); }

TEST_F(Pedestrian, SeedsDetermineThePaths) { EXPECT_EQ(expect_seeds_to_decide(2).paths.size(), 2u); }

TEST_F(Pedestrian, RefusesInvalidOptions) {
  PedestrianOptions o = options(2);
  o.worlds.scenarios = 4;
  EXPECT_THAT(message_of([&] { probe(o); }), HasSubstr("divisible among 3 policies, got 4"));
  o = options(2);
  o.hider_range_m = 3;
  EXPECT_THAT(message_of([&] { probe(o); }), HasSubstr("a range above 5 m, got 3"));
}

// ---- results

/// Two paths of two scenes: hidden at the first point (on one path at the second, too), then seen, then hidden again.
PedestrianResults made_up_pedestrians() {
  PedestrianResults all;
  all.setting.maps = {"a"};
  all.policies = {{"one", "one.ckpt", "h", true}};
  all.paths_asked = 3;
  const auto add = [&all](int scene, const std::vector<float>& shares, int first_seen, int hidden_again) {
    all.paths.push_back({.scene = scene,
                         .map_origin_m = {388096, 3948956, 12},
                         .first_point = static_cast<int32_t>(all.points.size()),
                         .num_points = static_cast<int32_t>(shares.size()),
                         .first_seen = first_seen,
                         .hidden_again = hidden_again});
    for (size_t i = 0; i < shares.size(); ++i) {
      const auto path = static_cast<int32_t>(all.paths.size()) - 1;
      all.points.push_back(
          {.path = path, .along_m = kPathSpacing_m * static_cast<float>(i), .visible_share = shares[i]});
      all.responses.push_back({1 - 2 * shares[i], 1, 0.5f + shares[i] / 4, 0.5f});
    }
  };
  add(3, {0, 0.5f, 1, 0}, 1, 3);
  add(4, {0, 0, 1, 0, 0}, 2, 3);
  return all;
}

const PedestrianRow& row_at(const std::vector<PedestrianRow>& rows, int offset) {
  for (const PedestrianRow& row : rows) {
    if (row.offset == offset) return row;
  }
  throw Error("no such row");
}

TEST(PedestrianResults, MeansAreAlignedAtFirstSight) {
  const std::vector<PedestrianRow> rows = summarize(made_up_pedestrians());
  ASSERT_EQ(rows.size(), 3u + 5);
  EXPECT_EQ(rows[0].phase, PathPhase::hidden);
  EXPECT_EQ(rows[0].cases, 3);
  EXPECT_EQ(rows[0].value_change.value, 0);
  EXPECT_EQ(rows[0].changed_share.value, 0);
  EXPECT_EQ(rows[1].phase, PathPhase::seen);
  EXPECT_EQ(rows[1].cases, 3);
  EXPECT_DOUBLE_EQ(rows[1].value_change.value, -(1.5 + 2) / 2) << "of the scenes' means";
  EXPECT_EQ(rows[2].cases, 3);
  EXPECT_EQ(row_at(rows, -2).scenes, 1);
  const PedestrianRow& first_sight = row_at(rows, 0);
  EXPECT_EQ(first_sight.scenes, 2);
  EXPECT_DOUBLE_EQ(first_sight.mean_visible_share, 0.75);
  EXPECT_DOUBLE_EQ(first_sight.value_change.value, -1.5);
  EXPECT_DOUBLE_EQ(first_sight.brake_change.value, (0.125 + 0.25) / 2);
  // Values 1 and 2: the standard deviation is sqrt(1/2), that of the mean 1/2.
  EXPECT_NEAR(first_sight.value_change.half_width_95, 0.98, 1e-9);
}

TEST(PedestrianResults, AreWrittenPerPlace) {
  const test::ScratchFolder folder;
  const PedestrianResults all = made_up_pedestrians();
  write_pedestrian_cases(folder / "cases.csv", all);
  const auto table = read_table(folder / "cases.csv");
  ASSERT_EQ(table.size(), 10u);
  ASSERT_EQ(table[0].size(), table[1].size());
  EXPECT_EQ(table[0][11], "from_first_sight_m");
  EXPECT_EQ(table[1][11], "-0.5");
  EXPECT_EQ(table[2][16], "seen");
  EXPECT_EQ(table[3][19], "-2") << table[0][19];
  EXPECT_EQ(table[9][16], "hidden again");
  EXPECT_EQ(table[0][12], "x_m");
  EXPECT_EQ(table[1][12], "388096.000");
  EXPECT_EQ(table[1][13], "3948956.000");

  const auto json = nlohmann::json::parse(pedestrian_summary_json(all, summarize(all), "cases.csv"));
  EXPECT_EQ(json.at("kind"), "pedestrian");
  EXPECT_EQ(json.at("paths"), 2);
  EXPECT_EQ(json.at("paths_asked"), 3);
  EXPECT_EQ(json.at("cases"), 9);
  EXPECT_EQ(json.at("policy")[0].at("cases_driven"), 9);
  EXPECT_EQ(json.at("rows")[1].at("phase"), "seen");
  EXPECT_TRUE(json.at("rows")[3].at("phase").is_null());
  EXPECT_EQ(json.at("rows")[3].at("from_first_sight_m"), -1);
}

}  // namespace
}  // namespace pictura
