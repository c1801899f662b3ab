#include "pictura/simulator/rules/reward.h"

#include <cmath>

#include <gtest/gtest.h>

namespace pictura {
namespace {

struct RewardTest : ::testing::Test {
  RewardTest() {
    facts.fit.lane = 0;
    facts.fit.offset_m = 0.7f;
    facts.fit.angle_rad = 0;
    facts.fit.speed_limit_mps = 10;
    facts.motion.speed_mps = 5;
  }
  float& c(Conditioning which) { return coefficients[static_cast<int>(which)]; }
  RewardTerms terms() const { return reward_terms(facts, coefficients, 0.1f); }

  StepFacts facts;
  float coefficients[kNumConditioning] = {};
};

TEST_F(RewardTest, GoalRewardsWaypointsAndTheLastOneOnlyBelowItsSpeed) {
  c(Conditioning::v_goal_mps) = 5;
  EXPECT_EQ(terms().goal, 0);
  facts.passed_waypoint = true;
  EXPECT_EQ(terms().goal, 1);
  facts.passed_waypoint = false;
  facts.passed_last_waypoint = true;
  EXPECT_EQ(terms().goal, 0);  // 5 m/s is not below 5 m/s
  facts.motion.speed_mps = 4.9f;
  EXPECT_EQ(terms().goal, 1);
}

TEST_F(RewardTest, Infractions) {
  c(Conditioning::collision) = 2;
  c(Conditioning::off_road) = 1.5f;
  c(Conditioning::stop_line) = 0.5f;
  facts.motion.speed_mps = -5;
  EXPECT_EQ(terms().collision, 0);
  facts.collision = facts.off_road = facts.red_light = true;
  EXPECT_FLOAT_EQ(terms().collision, -2.5f);
  EXPECT_FLOAT_EQ(terms().off_road, -1.5f);
  EXPECT_FLOAT_EQ(terms().stop_line, -0.5f);
}

TEST_F(RewardTest, ComfortCountsThreeKinds) {
  c(Conditioning::comfort) = 0.1f;
  facts.motion.accel_long_mps2 = -3;
  EXPECT_EQ(terms().comfort, 0);
  facts.motion.accel_long_mps2 = -3.1f;
  EXPECT_FLOAT_EQ(terms().comfort, -0.1f);
  facts.motion.accel_lat_mps2 = 3.1f;
  EXPECT_FLOAT_EQ(terms().comfort, -0.2f);
  facts.motion.jerk_long_mps3 = 6;
  facts.motion.jerk_lat_mps3 = -6;
  EXPECT_FLOAT_EQ(terms().comfort, -0.3f);
}

TEST_F(RewardTest, LaneAlign) {
  c(Conditioning::lane_align) = 0.02f;
  c(Conditioning::vel_align) = 0.5f;
  facts.fit.angle_rad = 0.5f;
  EXPECT_NEAR(terms().lane_align, 0.02 * 0.1 * 0.0025 * (1 - 0.5 * 2 / M_PI), 1e-10);
  facts.fit.angle_rad = -2.5f;
  const double cosine = std::cos(2.5);
  EXPECT_NEAR(terms().lane_align, 0.002 * (cosine + 0.5 * 5 * cosine + 0.0025 * (1 - 2.5 * 2 / M_PI)), 1e-8);
  facts.motion.speed_mps = -1;  // backwards against the lane: no velocity term
  EXPECT_NEAR(terms().lane_align, 0.002 * (cosine + 0.0025 * (1 - 2.5 * 2 / M_PI)), 1e-8);
}

TEST_F(RewardTest, LaneCenterMeasuresFromTheBias) {
  c(Conditioning::lane_center) = 0.005f;
  c(Conditioning::center_bias_m) = -0.5f;
  EXPECT_NEAR(terms().lane_center, -0.005 * 0.1 * (1.2 - 0.05 * std::exp(-0.7)), 1e-9);
  facts.fit.angle_rad = 2;  // cosine below 0.5: only the exponential term remains
  EXPECT_NEAR(terms().lane_center, 0.005 * 0.1 * 0.05 * std::exp(-0.7), 1e-9);
}

TEST_F(RewardTest, VelocityReverseOverspeedTimestep) {
  c(Conditioning::velocity) = 2.5e-3f;
  c(Conditioning::reverse) = 0.005f;
  c(Conditioning::overspeed) = 0.4f;
  c(Conditioning::timestep) = 2.5e-5f;
  facts.fit.angle_rad = 1;
  EXPECT_NEAR(terms().velocity, 2.5e-4 * std::cos(1.0), 1e-9);
  EXPECT_EQ(terms().reverse, 0);
  EXPECT_NEAR(terms().timestep, -2.5e-6, 1e-11);
  facts.motion.speed_mps = 2.5f;
  EXPECT_EQ(terms().velocity, 0);
  facts.motion.speed_mps = -0.1f;
  EXPECT_NEAR(terms().reverse, -5e-4, 1e-9);
  facts.motion.speed_mps = 12;
  EXPECT_EQ(terms().overspeed, 0);
  facts.motion.speed_mps = 12.01f;
  EXPECT_FLOAT_EQ(terms().overspeed, -0.4f);
  facts.motion.speed_mps = 0;
  EXPECT_EQ(terms().timestep, 0);
  facts.motion.accel_long_mps2 = -1;
  EXPECT_NEAR(terms().timestep, -2.5e-6, 1e-11);
}

TEST_F(RewardTest, LaneRewardsAreZeroWithoutALane) {
  for (int i = 0; i < kNumConditioning; ++i) coefficients[i] = 1;
  facts.fit = LaneFit{};
  EXPECT_NEAR(terms().lane_align, 0, 1e-7);
  EXPECT_EQ(terms().velocity, 0);
}

TEST_F(RewardTest, TotalIsTheSumOfAllEleven) {
  const RewardTerms r{1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024};
  EXPECT_EQ(r.total(), 2047);
}

}  // namespace
}  // namespace pictura
