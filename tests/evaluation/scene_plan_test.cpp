// Protocols of recorded scenes: their settings, and the roles of agents that follow from the settings.
#include "pictura/evaluation/scene_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"

namespace pictura {
namespace {

using test::crossing;
using ::testing::HasSubstr;

int count_of(const std::vector<uint8_t>& mask) { return static_cast<int>(std::count(mask.begin(), mask.end(), 1)); }
int count_of(const ScenePlan& plan, SceneRole role) {
  return static_cast<int>(std::count(plan.roles.begin(), plan.roles.end(), role));
}

/// Boxes of the scene's tracks at a step, as in the simulator.
std::vector<AgentBox> boxes_at(const Scenario& scene, int32_t step) {
  std::vector<AgentBox> boxes;
  for (size_t track = 0; track < scene.tracks.size(); ++track) {
    const TrackState& state = scene.states_of(static_cast<int32_t>(track))[step];
    const SinCos heading = sincos_of(state.heading_rad);
    AgentBox box;
    box.center_m = state.position_m;
    box.cos_heading = heading.cos;
    box.sin_heading = heading.sin;
    box.length_m = scene.tracks[track].length_m;
    box.width_m = scene.tracks[track].width_m;
    box.height_m = scene.tracks[track].height_m;
    box.drawn = scene.valid_of(static_cast<int32_t>(track))[step];
    boxes.push_back(box);
  }
  return boxes;
}

TEST(SceneProtocols, RulesCanBeChosenIndividually) {
  EXPECT_THAT(scene_protocol_names(),
              ::testing::ElementsAre("womd", "gpudrive", "pufferdrive2", "pufferdrive3", "waymax", "simagents"));
  EXPECT_EQ(scene_protocol("womd").steps, 600);
  EXPECT_EQ(scene_protocol("waymax").start_step, 10);
  EXPECT_FLOAT_EQ(scene_protocol("pufferdrive2").box_scale, 0.7f);
  EXPECT_THAT(test::message_of<UsageError>([] { scene_protocol("wosac"); }), HasSubstr("womd, gpudrive"));

  SceneProtocol protocol = scene_protocol("womd");
  for (const SceneProtocol& known : scene_protocols()) {
    // Every rule is written as it is read back.
    for (const auto& [name, value] : rules_of(known)) set_scene_rule(name + "=" + value, &protocol);
    EXPECT_EQ(rules_of(protocol), rules_of(known)) << known.name;
  }
  protocol = scene_protocol("womd");
  set_scene_rule("late=drive", &protocol);
  set_scene_rule("least_way_m=0.5", &protocol);
  EXPECT_EQ(protocol.late, Late::drive);
  EXPECT_FLOAT_EQ(protocol.min_distance_to_goal_m, 0.5f);
  const auto refusal = [&](const std::string& rule) {
    return test::message_of<UsageError>([&] { set_scene_rule(rule, &protocol); });
  };
  EXPECT_THAT(refusal("late"), HasSubstr("expected NAME=VALUE, got 'late'"));
  EXPECT_THAT(refusal("later=drive"), HasSubstr("late"));
  EXPECT_THAT(refusal("late=never"), HasSubstr("rule late: expected replay, drive, absent, got 'never'"));
  EXPECT_THAT(refusal("rollouts=1.5"), HasSubstr("rule rollouts: expected a whole number of 1 to 1000, got '1.5'"));
  EXPECT_THAT(refusal("box_scale=big"), HasSubstr("rule box_scale: expected a number of 0 to 2, got 'big'"));
  protocol.control = "cars";
  EXPECT_THAT(test::message_of<UsageError>([&] { check(protocol); }), HasSubstr("got 'cars'"));
  protocol = scene_protocol("womd");
  protocol.densities = {0};
  EXPECT_THAT(test::message_of<UsageError>([&] { check(protocol); }), HasSubstr("density"));
}

TEST(SceneProtocols, ThinTheSameRoadUsersForASeed) {
  const auto scene = crossing({.num_vehicles = 40});
  const auto others = static_cast<int>(scene->tracks.size()) - 1;
  EXPECT_EQ(count_of(select_thinned_tracks(*scene, 1, 1)), 0);
  const std::vector<uint8_t> some = select_thinned_tracks(*scene, 0.75, 1),
                             many = select_thinned_tracks(*scene, 0.5, 1);
  EXPECT_EQ(count_of(some), std::lround(0.25 * others));
  EXPECT_EQ(count_of(many), std::lround(0.5 * others));
  for (size_t track = 0; track < some.size(); ++track) EXPECT_LE(some[track], many[track]);
  EXPECT_EQ(select_thinned_tracks(*scene, 0.5, 1), many);
  EXPECT_NE(select_thinned_tracks(*scene, 0.5, 2), many);
  for (uint64_t seed = 0; seed < 50; ++seed) {
    EXPECT_EQ(select_thinned_tracks(*scene, 0.1, seed)[scene->sdc_track], 0) << "never the own car";
  }
}

TEST(SceneProtocols, ReplaceImplausibleFirstHeadings) {
  const auto scene = crossing();
  const auto first_heading_deg = [&](const char* protocol_name, float max_deg, float turn_deg) {
    SceneProtocol protocol = scene_protocol(protocol_name);
    protocol.max_first_turn_deg = max_deg;
    Scenario turned = *scene;
    const auto index = static_cast<size_t>(turned.sdc_track * turned.num_steps + protocol.start_step);
    const float recorded_rad = turned.states[index].heading_rad;
    turned.states[index + 1].heading_rad = recorded_rad;
    turned.states[index].heading_rad = wrap_angle(recorded_rad + turn_deg * kPi / 180);
    const auto adapted = protocol_scene(turned, protocol);
    EXPECT_EQ(adapted->states[index + 1].heading_rad, recorded_rad);
    EXPECT_EQ(adapted->repaired_headings, adapted->states[index].heading_rad == recorded_rad);
    return wrap_angle(adapted->states[index].heading_rad - recorded_rad) * 180 / kPi;
  };
  for (const char* name : {"womd", "waymax"}) {  // from the first step on, and from a later one
    SCOPED_TRACE(name);
    EXPECT_NEAR(first_heading_deg(name, 0, 120), 120, 1e-3) << "as recorded by default";
    EXPECT_NEAR(first_heading_deg(name, 10, -8), -8, 1e-3);
    EXPECT_EQ(first_heading_deg(name, 10, -12), 0);
    EXPECT_EQ(first_heading_deg(name, 10, 179), 0);
    EXPECT_NEAR(first_heading_deg(name, 10, 355), -5, 1e-3);
  }
}

class ScenePlans : public ::testing::Test {
 protected:
  ScenePlan plan(const SceneProtocol& protocol, double density = 1) const {
    const auto scaled = protocol_scene(*scene_, protocol);
    const auto map = compile_scenario(scaled, {.walls = false}, protocol.start_step);
    return plan_scene(*map, boxes_at(*scaled, protocol.start_step), protocol, density, 1);
  }
  std::shared_ptr<const Scenario> scene_ = crossing();  // 4 of 8 vehicles move
};

TEST_F(ScenePlans, DriveTracksThatAreNotAtTheirGoals) {
  const ScenePlan all = plan(scene_protocol("womd"));
  for (size_t track = 0; track < all.roles.size(); ++track) {
    const bool drives = scene_->tracks[track].type == TrackType::vehicle && is_moving(*scene_, int32_t(track)) &&
                        scene_->valid_of(int32_t(track))[0];
    EXPECT_EQ(all.roles[track] == SceneRole::driven, drives) << track;
    if (drives) {
      EXPECT_EQ(all.takeover_steps[track], 0);
    }
  }
  EXPECT_GE(count_of(all, SceneRole::driven), 3);
  const ScenePlan half = plan(scene_protocol("womd"), 0.5);
  EXPECT_EQ(count_of(half, SceneRole::removed), std::lround(0.5 * 11));

  const ScenePlan self = plan(scene_protocol("waymax"));
  EXPECT_EQ(count_of(self, SceneRole::driven), 1);
  EXPECT_EQ(self.roles[scene_->sdc_track], SceneRole::driven);

  SceneProtocol protocol = scene_protocol("womd");
  protocol.max_driven = 2;
  EXPECT_EQ(count_of(plan(protocol), SceneRole::driven), 2);
  EXPECT_EQ(plan(protocol).roles[scene_->sdc_track], all.roles[scene_->sdc_track]);
  protocol = scene_protocol("womd");
  protocol.others = Others::absent;
  EXPECT_EQ(count_of(plan(protocol), SceneRole::removed), 4);
  protocol.control = "all";
  EXPECT_LT(count_of(plan(protocol), SceneRole::removed), 4) << "who is driven stays";
}

TEST_F(ScenePlans, TakeOverTracksThatAppearLater) {
  Scenario late = *scene_;
  int32_t mover = 0;
  while (!is_moving(late, mover) || late.tracks[size_t(mover)].type != TrackType::vehicle) ++mover;
  // The track appears at step 7.
  const auto at = static_cast<size_t>(mover);
  for (size_t step = 0; step < 7; ++step) {
    late.valid[at * size_t(late.num_steps) + step] = 0;
    late.states[at * size_t(late.num_steps) + step] = {};
  }
  late.tracks[at].first_valid = 7;
  scene_ = std::make_shared<const Scenario>(late);
  SceneProtocol protocol = scene_protocol("womd");
  EXPECT_EQ(plan(protocol).roles[at], SceneRole::replayed);
  protocol.late = Late::absent;
  EXPECT_EQ(plan(protocol).roles[at], SceneRole::removed);
  protocol.late = Late::drive;
  const ScenePlan driven = plan(protocol);
  EXPECT_EQ(driven.roles[at], SceneRole::driven);
  EXPECT_EQ(driven.takeover_steps[at], 7);
}

TEST_F(ScenePlans, LeaveOverlappingTracksToTheRecording) {
  Scenario scene = *scene_;
  int32_t mover = 0;
  while (!is_moving(scene, mover) || scene.tracks[size_t(mover)].type != TrackType::vehicle) ++mover;
  // A parked vehicle stands where it starts.
  int32_t parked = 0;
  while (is_moving(scene, parked) || scene.tracks[size_t(parked)].type != TrackType::vehicle) ++parked;
  const TrackState start = scene.states_of(mover)[0];
  for (int32_t step = 0; step < scene.num_steps; ++step) {
    scene.states[size_t(parked) * size_t(scene.num_steps) + size_t(step)] = start;
  }
  scene_ = std::make_shared<const Scenario>(scene);
  SceneProtocol protocol = scene_protocol("womd");
  EXPECT_EQ(plan(protocol).roles[size_t(mover)], SceneRole::replayed);
  protocol.overlapping = Overlapping::drive;
  EXPECT_EQ(plan(protocol).roles[size_t(mover)], SceneRole::driven);
}

TEST_F(ScenePlans, PutWaypointsOnTheRecordedPath) {
  const auto map = compile_scenario(scene_, {.walls = false}, 0);
  int32_t mover = 0;
  while (!is_moving(*scene_, mover)) ++mover;
  const std::vector<Vec3> waypoints = path_waypoints(*map, mover, 0);
  ASSERT_EQ(waypoints.size(), 3u);
  const Vec3 start = map->rules.record.states[size_t(mover) * size_t(scene_->num_steps)].position_m;
  const float way_m = length((waypoints[2] - start).xy());
  EXPECT_NEAR(length((waypoints[0] - start).xy()), way_m / 3, 0.1f * way_m);
  EXPECT_NEAR(length((waypoints[1] - start).xy()), 2 * way_m / 3, 0.1f * way_m);
  EXPECT_EQ(waypoints[2].x, map->rules.record.agents[size_t(mover)].goal_m.x);
}

TEST(ScenePlan, ScalesBoxesAndRefusesOtherTimeSteps) {
  const auto scene = crossing();
  SceneProtocol protocol = scene_protocol("gpudrive");
  EXPECT_FLOAT_EQ(protocol_scene(*scene, protocol)->tracks[0].length_m, 0.7f * scene->tracks[0].length_m);
  Scenario slow = *scene;
  slow.dt_s = 0.2f;
  EXPECT_THAT(test::message_of<Error>([&] { protocol_scene(slow, protocol); }),
              HasSubstr("expected time steps of 0.1 s, got 0.2 s"));
}

}  // namespace
}  // namespace pictura
