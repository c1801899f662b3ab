// The realism score compared with values computed by hand: each feature, likelihoods, and files of rollouts.
// tests/python/test_realism.py compares the score with a second implementation.
#include "pictura/evaluation/realism.h"

#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/rng.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/protobuf_writer.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
constexpr double kHalfTurn = M_PI, kQuarterTurn = M_PI / 2;

TEST(RealismBoxes, DistancesAreBetweenRoundedSidesAndCorners) {
  const RealismBox car{0, 0, 0, 4, 2};
  // Front to back.
  EXPECT_NEAR(rounded_box_distance_m(car, {10, 0, 0, 4, 2}), 6, 1e-12);
  EXPECT_NEAR(rounded_box_distance_m(car, {10, 0, kHalfTurn, 4, 2}), 6, 1e-12);
  // The other across: half a length and half a width between the centres.
  EXPECT_NEAR(rounded_box_distance_m(car, {10, 0, kQuarterTurn, 4, 2}), 7, 1e-12);
  // Corner to corner: without rounding the corners are (3, 4) apart. Each radius is 0.7, so the cores' are (4.4, 5.4).
  EXPECT_NEAR(rounded_box_distance_m(car, {7, 6, 0, 4, 2}), std::hypot(4.4, 5.4) - 1.4, 1e-12);
  // Overlap: the shortest way apart is sideways, 0.5 m.
  EXPECT_NEAR(rounded_box_distance_m(car, {1, 1.5, 0, 4, 2}), -0.5, 1e-12);
  EXPECT_NEAR(rounded_box_distance_m(car, car), -2, 1e-12);
  // Sharp corners would overlap, rounded ones do not: cores' corners are (0.7, 0.7) * 2 less 0.1 apart.
  EXPECT_NEAR(rounded_box_distance_m(car, {3.9, 1.9, 0, 4, 2}), std::hypot(1.3, 1.3) - 1.4, 1e-12);
  EXPECT_GT(rounded_box_distance_m(car, {3.9, 1.9, 0, 4, 2}), 0);
}

TEST(RealismTimes, TimeToCollisionIsGapOverClosingSpeed) {
  const RealismBox car{0, 0, 0, 4, 2};
  double gap_m = 0;
  EXPECT_NEAR(time_to_collision_s(car, 10, {14, 0, 0, 4, 2}, 5, &gap_m), 2, 1e-12);
  EXPECT_NEAR(gap_m, 10, 1e-12);
  // Never, and beyond the bound: 5 s, although it is followed.
  EXPECT_EQ(time_to_collision_s(car, 5, {14, 0, 0, 4, 2}, 5, &gap_m), 5);
  EXPECT_EQ(time_to_collision_s(car, 6, {14, 0, 0, 4, 2}, 5, &gap_m), 5);
  EXPECT_TRUE(std::isfinite(gap_m));
  EXPECT_EQ(time_to_collision_s(car, NAN, {14, 0, 0, 4, 2}, 5, &gap_m), 5);
  const auto follows = [&](const RealismBox& leader) {
    time_to_collision_s(car, 10, leader, 5, &gap_m);
    return std::isfinite(gap_m);
  };
  EXPECT_FALSE(follows({-14, 0, 0, 4, 2})) << "behind";
  EXPECT_FALSE(follows({3, 1.5, 0, 4, 2})) << "beside";
  EXPECT_FALSE(follows({14, 2.1, 0, 4, 2})) << "in the next lane";
  constexpr double kDegree = M_PI / 180;
  EXPECT_TRUE(follows({14, 0, 74 * kDegree, 4, 2}));
  EXPECT_FALSE(follows({14, 0, 76 * kDegree, 4, 2})) << "crosses";
  // At 9 and 11 degrees half of its width is 1.30 and 1.36 m: overlaps of 0.40 and 0.46 m are small.
  EXPECT_TRUE(follows({14, 1.9, 9 * kDegree, 4, 2}));
  EXPECT_FALSE(follows({14, 1.9, 11 * kDegree, 4, 2}));
  EXPECT_TRUE(follows({14, 1.7, 11 * kDegree, 4, 2}));
}

TEST(RealismMotion, UsesCentralDifferences) {
  const std::vector<double> squares{0, 1, 4, 9, 16};
  const std::vector<double> rates = central_differences(squares, 0.5);
  EXPECT_THAT(std::vector<double>(rates.begin() + 1, rates.end() - 1), ::testing::ElementsAre(4, 8, 12));
  EXPECT_TRUE(std::isnan(rates.front()) && std::isnan(rates.back()));
  const std::vector<double> angles{3.1, NAN, -3.1};
  EXPECT_NEAR(central_differences(angles, 0.1, true)[1], (2 * M_PI - 6.2) / 0.2, 1e-12) << "the shorter way round";
}

TEST(RealismLikelihoods, AreSharesOfSmoothedBins) {
  const RealismTerm term{1, 0, 10, 5, 0.1};
  // Bins of 2: counts 3, 0, 1, 0, 1 of five; values above the range count in the last bin, NaN in no bin.
  const std::vector<double> simulated{0, 1, 1.9, 4, 99, NAN}, recorded{-1, 3, 10, NAN};
  const std::vector<double> logs = log_likelihoods(term, recorded, simulated);
  EXPECT_NEAR(std::exp(logs[0]), 3.1 / 5.5, 1e-12);
  EXPECT_NEAR(std::exp(logs[1]), 0.1 / 5.5, 1e-12);
  EXPECT_NEAR(std::exp(logs[2]), 1.1 / 5.5, 1e-12);
  EXPECT_TRUE(std::isnan(logs[3]));
  const std::vector<double> nothing{NAN};
  EXPECT_TRUE(std::isnan(log_likelihoods(term, recorded, nothing)[0]));
  const RealismTerm event{1, 0, 1, 0, 0.001};
  EXPECT_NEAR(std::exp(event_log_likelihood(event, false, 8, 32)), 24.001 / 32.002, 1e-12);
  EXPECT_NEAR(std::exp(event_log_likelihood(event, true, 8, 32)), 8.001 / 32.002, 1e-12);
}

TEST(RealismVersions, WeightsSumToOne) {
  EXPECT_THAT(realism_version_names(), ::testing::ElementsAre("2024", "2025"));
  for (const RealismVersion& version : realism_versions()) {
    double sum = 0;
    for (const RealismTerm& term : version.terms) sum += term.weight;
    EXPECT_NEAR(sum, 1, 1e-12) << version.name;
  }
  EXPECT_EQ(realism_version("2024").terms[size_t(RealismFeature::red_light)].weight, 0);
  EXPECT_THAT(message_of<UsageError>([] { realism_version("2023"); }), HasSubstr("2024 or 2025"));
}

/// A straight road along x, 8 m wide, with a light whose line lies at x = 20 and turns green at step 50. Car 7 drives
/// in the middle at 8 m/s, from x = 0 at step 0; car 9 stands 36 m ahead of its start.
Scenario straight_road() {
  LoggedScene scene;
  scene.source = scene.id = "straight";
  scene.num_steps = 91;
  scene.current_step = 10;
  scene.is_authored = true;
  scene.tolerance_m = 0;
  scene.origin_m = Eigen::Vector3d(0, 0, 0);
  LoggedLane before{.id = 1, .points = {{-20, 0, 0}, {20, 0, 0}}, .exits = {2}};
  LoggedLane after{.id = 2, .points = {{20, 0, 0}, {100, 0, 0}}, .entries = {1}};
  scene.lanes = {before, after};
  // The road on their left.
  scene.edges = {{.id = 3, .points = {{-20, -4, 0}, {100, -4, 0}}}, {.id = 4, .points = {{100, 4, 0}, {-20, 4, 0}}}};
  LoggedLight light{.lanes = {2}, .has_stop_line = true, .stop_a_m = {20, 2, 0}, .stop_b_m = {20, -2, 0}};
  for (int step = 0; step < 91; ++step) {
    light.states.push_back(step < 50 ? RecordedLightState::stop : RecordedLightState::go);
  }
  scene.lights = {light};
  for (const int64_t id : {7, 9}) {
    LoggedTrack track{.id = id, .type = TrackType::vehicle};
    for (int step = 0; step < 91; ++step) {
      LoggedState state;
      state.center_m = {id == 7 ? 0.8 * step : 36, id == 7 ? 0 : 2.5, 0};
      state.velocity_x_mps = id == 7 ? 8 : 0;
      state.length_m = 4;
      state.width_m = 2;
      state.height_m = 1.5;
      state.valid = true;
      track.states.push_back(state);
    }
    scene.tracks.push_back(track);
  }
  scene.sdc_track = 0;
  scene.predictions = {{0, 0}};
  return make_scenario(std::move(scene));
}

/// Car 7 continues from its place at step 10 with this velocity; car 9 stands.
SceneRollouts rollout_at(double speed_mps, double sideways_mps, int count = 1) {
  SceneRollouts rollouts{"straight", kChallengeSteps, {7, 9}, {}};
  std::vector<SimulatedState> states;
  for (int step = 1; step <= kChallengeSteps; ++step) {
    states.push_back(
        {static_cast<float>(8 + 0.1 * step * speed_mps), static_cast<float>(0.1 * step * sideways_mps), 0.75f, 0});
  }
  states.resize(2 * kChallengeSteps, {36, 2.5f, 0.75f, 0});
  rollouts.rollouts.assign(static_cast<size_t>(count), states);
  return rollouts;
}

double feature(const RealismFeatures& features, RealismFeature which, size_t step) {
  return features.of(0, which)[step];
}

TEST(RealismScenes, HaveHandComputedFeatures) {
  const RealismScene scene(std::make_shared<const Scenario>(straight_road()));
  EXPECT_THAT(scene.track_ids(), ::testing::ElementsAre(7, 9));
  EXPECT_THAT(scene.scored_ids(), ::testing::ElementsAre(7));
  const RealismFeatures& recorded = scene.recorded_features();
  EXPECT_NEAR(feature(recorded, RealismFeature::speed, 0), 8, 1e-4);
  EXPECT_NEAR(feature(recorded, RealismFeature::acceleration, 0), 0, 1e-3);
  EXPECT_NEAR(feature(recorded, RealismFeature::turn_rate, 0), 0, 1e-9);
  EXPECT_TRUE(std::isnan(feature(recorded, RealismFeature::speed, 79)));
  EXPECT_TRUE(std::isnan(feature(recorded, RealismFeature::acceleration, 78)));
  EXPECT_FALSE(std::isnan(feature(recorded, RealismFeature::acceleration, 77)));
  // At step 11 its centre is at 8.8 m: 27.2 m and 2.5 m between the centres, 4.6 and 1.9 m of which the cores take.
  const double nearest_m = std::hypot(27.2 - 2 * 1.3, 2.5 - 2 * 0.3) - 1.4;
  EXPECT_NEAR(feature(recorded, RealismFeature::nearest_object, 0), nearest_m, 1e-4);
  EXPECT_EQ(feature(recorded, RealismFeature::time_to_collision, 0), 5) << "it passes 0.5 m beside it";
  EXPECT_NEAR(feature(recorded, RealismFeature::road_edge, 0), -3, 1e-4);
  EXPECT_EQ(feature(recorded, RealismFeature::off_road, 0), 0);
  // Its front, 2 m ahead, passes 20 m between steps 22 (19.6 m) and 23 (20.4 m), at red.
  for (size_t step = 0; step < 80; ++step) {
    EXPECT_EQ(feature(recorded, RealismFeature::red_light, step), step + 11 == 23 ? 1 : 0) << step;
  }

  // Slower: 3 m/s, so at 20 m after step 43 (17.9 + 2 = 19.9, 20.2 m), still red; at 1.5 m/s only at green.
  EXPECT_EQ(feature(scene.features(rollout_at(3, 0), 0), RealismFeature::red_light, 44 - 11), 1);
  const RealismFeatures slow = scene.features(rollout_at(1.5, 0), 0);
  for (size_t step = 0; step < 80; ++step) EXPECT_EQ(feature(slow, RealismFeature::red_light, step), 0);
  // It starts slower than it came: from 0.8 m a step to 0.15 m.
  EXPECT_NEAR(feature(slow, RealismFeature::speed, 0), 1.5, 1e-3);
  EXPECT_NEAR(feature(slow, RealismFeature::acceleration, 0), (1.5 - (0.8 + 0.15) / 0.2) / 0.2, 1e-2);

  // Towards the left edge at 1 m/s: its left side passes 4 m after 3 s, and it overlaps the car that stands, 2 m wide.
  const RealismFeatures drifts = scene.features(rollout_at(8, 1), 0);
  EXPECT_NEAR(feature(drifts, RealismFeature::road_edge, 9), -2, 1e-4) << "after 1 s";
  EXPECT_EQ(feature(drifts, RealismFeature::off_road, 28), 0);
  EXPECT_EQ(feature(drifts, RealismFeature::off_road, 31), 1);
  EXPECT_NEAR(feature(drifts, RealismFeature::road_edge, 49), 2, 1e-4) << "after 5 s, 2 m beyond";
  // After 1 s at 16 m and 1 m aside: 16 m to its back, 0.5 m of both overlap, at 8.06 m/s.
  EXPECT_NEAR(feature(drifts, RealismFeature::time_to_collision, 9), 16 / std::hypot(8, 1), 1e-3);
  EXPECT_EQ(feature(drifts, RealismFeature::collision, 34), 1) << "at 36 m";
  EXPECT_EQ(feature(drifts, RealismFeature::collision, 9), 0);
}

TEST(RealismScenes, ScoreTheRecordingUnderRollouts) {
  const RealismScene scene(std::make_shared<const Scenario>(straight_road()));
  const RealismVersion& version = realism_version("2025");
  const auto at = [](RealismFeature feature) { return static_cast<size_t>(feature); };
  const SceneRealism same = scene.score(rollout_at(8, 0, 32), version);
  // One bin has all 32 * 79 speeds.
  EXPECT_NEAR(same.pooled[at(RealismFeature::speed)], (32 * 79 + 0.1) / (32 * 79 + 1), 1e-6);
  EXPECT_NEAR(same.pooled[at(RealismFeature::time_to_collision)], (32 * 80 + 0.1) / (32 * 80 + 1), 1e-6);
  EXPECT_NEAR(same.pooled[at(RealismFeature::red_light)], 32.001 / 32.002, 1e-6);
  EXPECT_NEAR(same.ade_m, 0, 1e-3);
  EXPECT_EQ(same.red_light_rate, 1);
  EXPECT_EQ(same.recorded_red_light_rate, 1);
  EXPECT_EQ(same.comfort, 1);
  EXPECT_NEAR(same.progress, 1, 1e-6);
  EXPECT_NEAR(same.score_by_object, same.score, 1e-12) << "of one road user";

  // Half of them at 4 m/s: half as likely, except for the speeds, in which they differ.
  SceneRollouts mixed = rollout_at(8, 0, 1);
  mixed.rollouts.push_back(rollout_at(4, 0).rollouts[0]);
  const SceneRealism half = scene.score(mixed, version);
  EXPECT_NEAR(half.pooled[at(RealismFeature::speed)], (79 + 0.1) / (2 * 79 + 1), 0.02);
  // 0.4 m a step behind, 0.2 m * 81 on average.
  EXPECT_NEAR(half.ade_m, 0.4 * 40.5 / 2, 1e-3);
  EXPECT_NEAR(half.min_ade_m, 0, 1e-3);
  EXPECT_NEAR(half.progress, 0.75, 1e-3);
  EXPECT_EQ(half.comfort, 1) << "constant speeds";
  // The speed drops from 8 to 4 m/s in one step after 4 s: over 0.7 s that is 5.7 m/s^2.
  for (size_t step = 40; step < 80; ++step)
    mixed.rollouts[1][step].x_m = static_cast<float>(8 + 0.8 * 40 + 0.4 * double(step - 39));
  EXPECT_EQ(scene.score(mixed, version).comfort, 0.5);

  const SceneRealism astray = scene.score(rollout_at(8, 1, 4), version);
  EXPECT_EQ(astray.off_road_rate, 1);
  EXPECT_EQ(astray.collision_rate, 1);
  EXPECT_NEAR(astray.pooled[at(RealismFeature::off_road)], 0.001 / 4.002, 1e-9);
  EXPECT_LT(astray.score, half.score);
  EXPECT_LT(half.score, same.score);
  // The weights of 2024 have no lights.
  const SceneRealism in_2024 = scene.score(rollout_at(1.5, 0, 4), realism_version("2024"));
  EXPECT_GT(in_2024.score, scene.score(rollout_at(1.5, 0, 4), version).score);
}

TEST(RealismScenes, RefuseInvalidRollouts) {
  Scenario scenario = straight_road();
  scenario.dt_s = 0.2f;
  EXPECT_THAT(message_of<Error>([&] { RealismScene(std::make_shared<const Scenario>(scenario)); }),
              AllOf(HasSubstr("straight"), HasSubstr("0.2")));
  const RealismScene scene(std::make_shared<const Scenario>(straight_road()));
  SceneRollouts none = rollout_at(8, 0);
  none.rollouts.clear();
  EXPECT_THAT(message_of<Error>([&] { scene.score(none, realism_version("2025")); }), HasSubstr("got none"));
}

class RealismFiles : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) {
    const std::string path = folder_ / name;
    write_file(path, bytes);
    return path;
  }
  static std::string bytes_of(const std::vector<SceneRollouts>& scenes) {
    std::string bytes;
    for (const SceneRollouts& scene : scenes) append_bytes(1, encoded(scene), &bytes);
    return bytes;
  }
  test::ScratchFolder folder_;
};

TEST_F(RealismFiles, ReadBackEqual) {
  SceneRollouts scene = rollout_at(8, 0, 2);
  scene.rollouts[1][3].heading_rad = 1.5f;
  RolloutsFile file(folder_ / "a.binproto");
  file.write(scene);
  file.commit();
  // Unknown fields of other programs are skipped.
  std::string bytes = read_file(folder_ / "a.binproto");
  append_bytes(3, "somebody", &bytes);
  const RolloutsReader reader(write("b.binproto", bytes));
  EXPECT_THAT(reader.scenario_ids(), ::testing::ElementsAre("straight"));
  const SceneRollouts read = reader.read("straight");
  EXPECT_EQ(encoded(read), encoded(scene));

  // Objects in another order in the second rollout are the same.
  SceneRollouts turned = rollout_at(8, 0, 1);
  std::swap(turned.track_ids[0], turned.track_ids[1]);
  std::rotate(turned.rollouts[0].begin(), turned.rollouts[0].begin() + kChallengeSteps, turned.rollouts[0].end());
  const std::string first = encoded(rollout_at(8, 0, 1)), second = encoded(turned);
  std::string both;
  append_bytes(1, first + second.substr(second.find('\x12')), &both);
  EXPECT_EQ(encoded(RolloutsReader(write("c.binproto", both)).read("straight")), encoded(rollout_at(8, 0, 2)));
}

TEST_F(RealismFiles, ErrorsNameFileScenarioAndField) {
  EXPECT_THAT(
      message_of<Error>([&] { RolloutsReader(write("twice", bytes_of({rollout_at(8, 0), rollout_at(8, 0)}))); }),
      AllOf(HasSubstr("twice: scenario_rollouts[1]"), HasSubstr("'straight' occurs twice")));
  std::string other;
  append_integer(2, 2, &other);
  EXPECT_THAT(message_of<Error>([&] { RolloutsReader(write("type", other)); }),
              HasSubstr("submission_type: expected 1"));
  SceneRollouts short_one = rollout_at(8, 0);
  short_one.rollouts[0].resize(2 * 79);
  short_one.steps = 79;
  const RolloutsReader reader(write("short", bytes_of({short_one})));
  EXPECT_THAT(message_of<Error>([&] { reader.read("nowhere"); }), HasSubstr("scenario 'nowhere', got none"));
  const RealismScene scene(std::make_shared<const Scenario>(straight_road()));
  EXPECT_THAT(message_of<Error>([&] { scene.score(reader.read("straight"), realism_version("2025")); }),
              HasSubstr("expected rollouts of 80 steps, got 79"));
  // Every cut of a file is refused, or a shorter file.
  const std::string whole = bytes_of({rollout_at(8, 0)});
  for (size_t size = 1; size < whole.size(); size += 97) {
    EXPECT_NE(message_of<Error>([&] { RolloutsReader(write("cut", whole.substr(0, size))).read("straight"); }),
              test::kNoError)
        << size;
  }
  // Damaged bytes are refused or read as other numbers.
  RandomStream random({.seed = 1});
  for (int i = 0; i < 500; ++i) {
    std::string damaged = whole;
    damaged[random.bits() % damaged.size()] ^= static_cast<char>(1 << random.bits() % 8);
    const std::string path = write("damaged", damaged);
    message_of<Error>([&] {
      const RolloutsReader one(path);
      for (const std::string& id : one.scenario_ids()) scene.score(one.read(id), realism_version("2025"));
    });
  }
}

TEST_F(RealismFiles, MatchTheirScenes) {
  std::vector<SceneRollouts> scenes;
  for (const std::string id : {"a", "b", "c"}) {
    Scenario scenario = straight_road();
    scenario.id = id;
    write_scene_file(folder_ / (id + ".scenario"), scenario);
    if (id == "b") continue;
    scenes.push_back(rollout_at(id == "a" ? 8 : 4, 0, 4));
    scenes.back().scenario_id = id;
  }
  scenes.push_back(rollout_at(8, 0));
  const std::string path = write("r.binproto", bytes_of(scenes));
  double done = 0;
  const RealismReport report =
      score_rollouts(path, {folder_ / "a.scenario", folder_ / "b.scenario", folder_ / "c.scenario"},
                     realism_version("2025"), 1, [&done](double share) { done = share; });
  EXPECT_EQ(done, 1);
  ASSERT_EQ(report.scenes.size(), 2u);
  EXPECT_EQ(report.scenes[1].scenario_id, "c");
  EXPECT_EQ(report.without_rollouts, 1);
  EXPECT_THAT(report.unused, ::testing::ElementsAre("straight"));
  const Estimate mean = mean_of(report, &SceneRealism::score);
  EXPECT_NEAR(mean.value, (report.scenes[0].score + report.scenes[1].score) / 2, 1e-12);
  const Json json = realism_json(report);
  EXPECT_EQ(json["scored"], 2);
  EXPECT_NEAR(json["realism"].get<double>(), mean.value, 1e-12);
  EXPECT_EQ(json["likelihoods"].size(), kNumRealismFeatures);
  // Groups weigh as their features do: together they are the score.
  const double parts = 0.2 * mean_of(report, realism_groups()[0]).value +
                       0.45 * mean_of(report, realism_groups()[1]).value +
                       0.35 * mean_of(report, realism_groups()[2]).value;
  EXPECT_NEAR(parts, mean.value, 1e-12);
  EXPECT_THAT(message_of<Error>([&] { score_rollouts(path, {folder_ / "b.scenario"}, realism_version("2025"), 1); }),
              AllOf(HasSubstr("r.binproto"), HasSubstr("1 are not in it")));
}

}  // namespace
}  // namespace pictura
