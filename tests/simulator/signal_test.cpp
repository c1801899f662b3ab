#include "pictura/simulator/rules/signal.h"

#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/tests/simulator/stage.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

StopLine line_of_phase(int phase, int num_phases) {
  StopLine line;
  line.junction = 3;
  line.phase = phase;
  line.num_phases = num_phases;
  return line;
}

TEST(Signal, FixedTimingSharesTheCycleAmongPhases) {
  // Three phases of 10 + 3 + 2 s: in 90 s each is green for 20 s, yellow for 6 s and red otherwise.
  std::vector<LightPlan> plans;
  for (int phase = 0; phase < 3; ++phase) {
    plans.push_back(draw_light_plan(line_of_phase(phase, 3), phase, LightCycles::phases, true, 0.1f, 7, 0, 0));
  }
  std::vector<std::map<LightState, int>> counts(3);
  for (int step = 0; step < 900; ++step) {
    int moving = 0;
    for (size_t phase = 0; phase < 3; ++phase) {
      const LightState state = light_state(plans[phase], step);
      ++counts[phase][state];
      moving += state == LightState::green || state == LightState::yellow;
    }
    EXPECT_LE(moving, 1) << step;
  }
  for (const auto& count : counts) {
    EXPECT_EQ(count.at(LightState::green), 200);
    EXPECT_EQ(count.at(LightState::yellow), 60);
    EXPECT_EQ(count.at(LightState::red), 640);
  }
}

TEST(Signal, TrainingTimingIsDrawnPerJunctionAndEpisode) {
  int episodes_off = 0, lights_off = 0;
  double green_s = 0;
  constexpr int kEpisodes = 2000;
  for (uint32_t episode = 0; episode < kEpisodes; ++episode) {
    LightPlan first = draw_light_plan(line_of_phase(0, 2), 0, LightCycles::phases, false, 0.1f, 7, 0, episode);
    LightPlan second = draw_light_plan(line_of_phase(1, 2), 1, LightCycles::phases, false, 0.1f, 7, 0, episode);
    EXPECT_EQ(first.green_steps, second.green_steps);
    EXPECT_EQ(first.offset_steps, second.offset_steps);
    EXPECT_GE(first.green_steps, 10);
    EXPECT_LE(first.green_steps, 100);
    EXPECT_GE(first.yellow_steps, 15);
    EXPECT_LE(first.yellow_steps, 23);
    EXPECT_GE(first.red_steps, 3);
    EXPECT_LE(first.red_steps, 100);
    green_s += 0.1 * first.green_steps / kEpisodes;
    episodes_off += first.is_off && second.is_off;
    lights_off += first.is_off != second.is_off;
  }
  EXPECT_NEAR(green_s, 5.5, 0.3);
  EXPECT_NEAR(episodes_off / double{kEpisodes}, 0.2 + 0.8 * 0.04, 0.04);
  EXPECT_NEAR(lights_off / double{kEpisodes}, 0.8 * 2 * 0.2 * 0.8, 0.04);
}

/// Returns plans of two lights of one junction in different phases, in an episode of independent cycles.
std::array<LightPlan, 2> independent_pair(bool fixed, uint32_t episode) {
  std::array<LightPlan, 2> plans;
  for (int light = 0; light < 2; ++light) {
    plans[light] =
        draw_light_plan(line_of_phase(light, 2), light, LightCycles::independent, fixed, 0.1f, 7, 0, episode);
  }
  return plans;
}

/// Returns Pearson's correlation of two samples of equal length.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0, aa = 0, bb = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

TEST(Signal, IndependentLightsOfAJunctionHaveSeparateDraws) {
  constexpr int kEpisodes = 4000;
  int always_green = 0, both_always_green = 0;
  std::array<std::vector<double>, 2> green_steps, red_steps, offsets;
  for (uint32_t episode = 0; episode < kEpisodes; ++episode) {
    const std::array<LightPlan, 2> plans = independent_pair(false, episode);
    int in_episode = 0;
    for (size_t light = 0; light < 2; ++light) {
      const LightPlan& plan = plans[light];
      EXPECT_EQ(plan.num_phases, 1);
      EXPECT_EQ(plan.phase, 0);
      // Lights are off in the same episodes as where phases take turns.
      const LightPlan in_turns =
          draw_light_plan(line_of_phase(int(light), 2), int(light), LightCycles::phases, false, 0.1f, 7, 0, episode);
      EXPECT_EQ(plan.is_off, in_turns.is_off);
      in_episode += plan.red_steps == 0;
    }
    always_green += in_episode;
    both_always_green += in_episode == 2;
    if (in_episode > 0) continue;
    for (size_t light = 0; light < 2; ++light) {
      const LightPlan& plan = plans[light];
      green_steps[light].push_back(plan.green_steps);
      red_steps[light].push_back(plan.red_steps);
      offsets[light].push_back(plan.offset_steps /
                               static_cast<double>(plan.green_steps + plan.yellow_steps + plan.red_steps));
    }
  }
  // Three standard deviations: sqrt(.05 x .95 / 8000) = .0024 of the share, 1 / sqrt(3610) = .017 of correlations.
  EXPECT_NEAR(always_green / (2.0 * kEpisodes), 0.05, 0.0075);
  EXPECT_NEAR(both_always_green / double{kEpisodes}, 0.05 * 0.05, 0.0025);
  EXPECT_NEAR(correlation(green_steps[0], green_steps[1]), 0, 0.05);
  EXPECT_NEAR(correlation(red_steps[0], red_steps[1]), 0, 0.05);
  EXPECT_NEAR(correlation(offsets[0], offsets[1]), 0, 0.05);
  EXPECT_NEAR(std::accumulate(green_steps[0].begin(), green_steps[0].end(), 0.0) / double(green_steps[0].size()), 55,
              1.5);
}

TEST(Signal, AnAlwaysGreenLightIsGreenUnlessItIsOff) {
  int seen = 0, off = 0;
  for (uint32_t episode = 0; episode < 2000; ++episode) {
    for (const LightPlan& plan : independent_pair(false, episode)) {
      if (plan.red_steps > 0) continue;
      ++seen;
      off += plan.is_off;
      for (const int step : {0, 1, 99, 1279, 1 << 24}) {
        EXPECT_EQ(light_state(plan, step), plan.is_off ? LightState::off : LightState::green) << step;
      }
    }
  }
  EXPECT_GT(seen, 100);
  EXPECT_NEAR(off / double(seen), 0.36, 0.12);
}

TEST(Signal, IndependentLightsOfAnEvaluationAreRedForTwoOfFifteenSeconds) {
  constexpr int kEpisodes = 1000, kCycle = 150;
  int both_red = 0;
  for (uint32_t episode = 0; episode < kEpisodes; ++episode) {
    const std::array<LightPlan, 2> plans = independent_pair(true, episode);
    std::map<LightState, int> counts;
    for (int step = 0; step < kCycle; ++step) {
      const LightState first = light_state(plans[0], step), second = light_state(plans[1], step);
      ++counts[first];
      both_red += first == LightState::red && second == LightState::red;
    }
    EXPECT_EQ(counts[LightState::green], 100);
    EXPECT_EQ(counts[LightState::yellow], 30);
    EXPECT_EQ(counts[LightState::red], 20);
  }
  // Independent lights are red together with the product of their shares.
  EXPECT_NEAR(both_red / double{kEpisodes * kCycle}, (2.0 / 15) * (2.0 / 15), 0.004);
}

/// A straight of two lanes at y = 0 and y = 4. A line at x = 100 holds only the right lane (lane 0).
struct RedLight : ::testing::Test {
  RedLight() : stage(make_map(), 1) {}
  static std::shared_ptr<const RoadMap> make_map() {
    auto map = testing::stadium(200, 2);
    testing::add_light(map.get(), 100, 4, 1, {0});
    return map;
  }
  /// Puts the front bumper at x_m. The agent is 4 m long, so the bumper is 3.2 m ahead of the rear axle.
  void put_bumper(float x_m, float y_m, float heading_rad, float speed_mps) {
    const Vec2 forward{std::cos(heading_rad), std::sin(heading_rad)};
    stage.put(0, Vec2{x_m, y_m} - forward * 3.2f, heading_rad, speed_mps);
  }
  int step_with(LightState state) {
    stage.worlds.state.lights[0] = state;
    stage.step();
    return stage.events(0);
  }

  testing::Stage stage;
};

TEST_F(RedLight, CrossingOnRedIsAnEvent) {
  stage.set(0, Conditioning::stop_line, 0.75f);
  put_bumper(99.5f, 0, 0, 10);
  stage.worlds.state.lights[0] = LightState::red;
  EXPECT_NEAR(stage.step()[0], -0.75, 0.01);
  EXPECT_EQ(stage.events(0), kEventRedLight);
  EXPECT_EQ(stage.worlds.state.agents.status[0], AgentStatus::halted);
}

TEST_F(RedLight, OtherColoursAreNotEvents) {
  for (const LightState state : {LightState::green, LightState::yellow, LightState::off, LightState::unknown}) {
    put_bumper(99.5f, 0, 0, 10);
    EXPECT_EQ(step_with(state), kEventNone);
  }
}

TEST_F(RedLight, StoppingBeforeTheLineIsNotAnEvent) {
  put_bumper(98.5f, 0, 0, 10);
  EXPECT_EQ(step_with(LightState::red), kEventNone);
  EXPECT_EQ(step_with(LightState::red), kEventRedLight);  // half a metre later the bumper is past the line
}

TEST_F(RedLight, StandingOnALineThatTurnsRedIsNotAnEvent) {
  put_bumper(101, 0, 0, 0);
  EXPECT_EQ(step_with(LightState::yellow), kEventNone);
  EXPECT_EQ(step_with(LightState::red), kEventNone);
  put_bumper(101, 0, 0, 8);  // driving on from past the line is no event either
  EXPECT_EQ(step_with(LightState::red), kEventNone);
  EXPECT_EQ(step_with(LightState::red), kEventNone);
}

TEST_F(RedLight, CrossingInTheOppositeDirectionIsNotAnEvent) {
  put_bumper(100.5f, 0, kPi, 10);
  EXPECT_EQ(step_with(LightState::red), kEventNone);
  put_bumper(100, 2.3f, 1.0f, 10);  // crosses at 57 degrees
  EXPECT_EQ(step_with(LightState::red), kEventNone);
}

TEST_F(RedLight, CrossingOnTheNextLaneIsNotAnEvent) {
  put_bumper(99.5f, 4, 0, 10);
  EXPECT_EQ(step_with(LightState::red), kEventNone);
}

TEST_F(RedLight, ChangingIntoTheLanePastTheLineIsAnEvent) {
  // From the free lane, with its bumper 3 m past the line, the agent turns into the held lane. It is associated with
  // the held lane once its rear axle is nearer to it by more than the hysteresis.
  put_bumper(103, 0.8f, -0.3f, 5);
  stage.worlds.state.agents.lane[0] = 4;
  EXPECT_EQ(step_with(LightState::red), kEventRedLight);
  put_bumper(103, 0.8f, -0.3f, 5);
  stage.worlds.state.agents.lane[0] = 4;
  EXPECT_EQ(step_with(LightState::green), kEventNone);
}

TEST_F(RedLight, ChangingIntoTheLaneBeforeTheLineIsNotAnEvent) {
  put_bumper(95, 0.8f, -0.3f, 5);
  stage.worlds.state.agents.lane[0] = 4;
  EXPECT_EQ(step_with(LightState::red), kEventNone);
  EXPECT_EQ(stage.worlds.state.agents.lane[0], 0);
}

TEST_F(RedLight, ChangingIntoTheLaneFarPastTheLineIsNotAnEvent) {
  put_bumper(111, 0.8f, -0.3f, 5);
  stage.worlds.state.agents.lane[0] = 4;
  EXPECT_EQ(step_with(LightState::red), kEventNone);
  EXPECT_EQ(stage.worlds.state.agents.lane[0], 0);
}

TEST_F(RedLight, TurningRightIntoTheHeldLaneIsNotAnEvent) {
  // From the left across the road into the held lane, past the line: still 60 degrees off the lane's direction.
  put_bumper(103, 0.3f, -1.05f, 5);
  stage.worlds.state.agents.lane[0] = 4;
  EXPECT_EQ(step_with(LightState::red), kEventNone);
  // A turn before the line, well aligned, is none either.
  put_bumper(97, 0.3f, -0.5f, 3);
  stage.worlds.state.agents.lane[0] = 4;
  EXPECT_EQ(step_with(LightState::red), kEventNone);
}

/// A straight in three lanes: to x = 100 (lane 0), 2 m that the light holds (lane 4), and onwards behind the stop line
/// at x = 102 (lane 5, held too).
std::shared_ptr<const RoadMap> short_section(bool is_endless) {
  auto map = testing::stadium(200, 1);
  const auto append = [&map](std::vector<float> x_m, int32_t next) {
    Lane lane = map->lanes[0];
    lane.points.begin = static_cast<int32_t>(map->lane_points.size());
    for (const float x : x_m) map->lane_points.push_back({{x, 0, 0}, 0, 4, x - x_m[0]});
    lane.points.end = static_cast<int32_t>(map->lane_points.size());
    lane.length_m = x_m.back() - x_m.front();
    lane.successors.begin = static_cast<int32_t>(map->lane_links.size());
    map->lane_links.push_back(next);
    lane.successors.end = lane.successors.begin + 1;
    map->lanes.push_back(lane);
  };
  append({100, 102}, 5);
  append({102, 150, 200}, 1);
  map->lanes[0].points.end = map->lanes[0].points.begin + 11;
  map->lanes[0].length_m = 100;
  map->lane_links[map->lanes[0].successors.begin] = 4;
  map->lanes[4].is_endless = map->lanes[5].is_endless = is_endless;
  testing::add_light(map.get(), 102, 4, 1, {4, 5});
  return map;
}

TEST(RedLightSection, ContinuingToTheNextLaneIsNotAnEvent) {
  for (const bool is_endless : {true, false}) {
    testing::Stage stage(short_section(is_endless), 1);
    stage.put(0, {99.8f, 0}, 0, 10);  // the bumper is a metre past the line: it crossed on yellow
    ASSERT_EQ(stage.worlds.state.agents.lane[0], 0);
    stage.worlds.state.lights[0] = LightState::red;
    stage.step();
    EXPECT_EQ(stage.worlds.state.agents.lane[0], 4);
    EXPECT_EQ(stage.events(0), kEventNone);
    // The agent is so fast that it skips the short lane.
    stage.put(0, {100.2f, 0}, 0, 20);
    stage.worlds.state.agents.lane[0] = 0;
    stage.step();
    EXPECT_EQ(stage.worlds.state.agents.lane[0], 5);
    EXPECT_EQ(stage.events(0), kEventNone);
    // The bumper's crossing is an event whatever the lanes.
    stage.put(0, {98.3f, 0}, 0, 10);
    stage.step();
    EXPECT_EQ(stage.events(0), kEventRedLight);
  }
}

TEST(RedLightSection, LaneChangesAreTransitionsWithoutALink) {
  const MapRules map = make_map_rules(*short_section(false), {});
  EXPECT_FALSE(is_lane_change(map.view(), 0, 0));
  EXPECT_FALSE(is_lane_change(map.view(), 0, 4));
  EXPECT_FALSE(is_lane_change(map.view(), 0, 5));
  EXPECT_FALSE(is_lane_change(map.view(), 5, 4));  // backing up
  EXPECT_FALSE(is_lane_change(map.view(), -1, 4));
  EXPECT_FALSE(is_lane_change(map.view(), 4, -1));
  const MapRules side_by_side = make_map_rules(*testing::stadium(200, 2), {});
  EXPECT_TRUE(is_lane_change(side_by_side.view(), 4, 0));
  EXPECT_TRUE(is_lane_change(side_by_side.view(), 4, 1));
}

/// A straight of one lane at y = 0, held at x = 100. Beside it is a lane for oncoming traffic at y = 4, beyond a strip
/// of `median_m`.
std::shared_ptr<const RoadMap> two_way_road(float median_m) {
  auto map = testing::stadium(200, 1);
  Lane lane = map->lanes[0];
  lane.points.begin = static_cast<int32_t>(map->lane_points.size());
  for (const float x : {200.0f, 100.0f, 0.0f}) map->lane_points.push_back({{x, 4 + median_m, 0}, kPi, 4, 200 - x});
  lane.points.end = static_cast<int32_t>(map->lane_points.size());
  lane.successors = {};
  map->lanes.push_back(lane);
  testing::add_light(map.get(), 100, 4, 1, {0});
  return map;
}

TEST(RedLightOnATwoWayRoad, PassingALightOnTheOncomingLaneIsAnEvent) {
  for (const float median_m : {0.0f, 2.0f}) {
    testing::Stage stage(two_way_road(median_m), 1);
    const auto events = [&](Vec2 bumper, float heading_rad, LightState state) {
      stage.put(0, bumper - Vec2{std::cos(heading_rad), std::sin(heading_rad)} * 3.2f, heading_rad, 10);
      stage.worlds.state.lights[0] = state;
      stage.step();
      return stage.events(0) & kEventRedLight;
    };
    const float y_m = 4 + median_m;
    for (const float aside_m : {-1.5f, 0.0f, 1.5f}) {
      EXPECT_EQ(events({99.5f, y_m + aside_m}, 0, LightState::red), kEventRedLight) << y_m + aside_m;
      EXPECT_EQ(events({99.5f, y_m + aside_m}, 0.5f, LightState::red), kEventRedLight);
      EXPECT_EQ(events({99.5f, y_m + aside_m}, 0, LightState::green), kEventNone);
      EXPECT_EQ(events({100.5f, y_m + aside_m}, kPi, LightState::red), kEventNone);  // oncoming traffic
    }
    EXPECT_EQ(events({99.5f, -2.8f}, 0, LightState::red), kEventNone);  // no oncoming lane to the right
  }
}

TEST_F(RedLight, CrossingOnAnotherLevelIsNotAnEvent) {
  auto map = testing::stadium(200, 2);
  testing::add_light(map.get(), 100, 4, 1, {0});
  map->lights[0].stop_a_m.z = map->lights[0].stop_b_m.z = 6;
  testing::Stage bridge(map, 1);
  bridge.put(0, {96.3f, 0}, 0, 10);
  bridge.worlds.state.lights[0] = LightState::red;
  bridge.step();
  EXPECT_EQ(bridge.events(0), kEventNone);
}

}  // namespace
}  // namespace pictura
