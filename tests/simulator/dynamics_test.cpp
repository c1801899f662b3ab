#include "pictura/simulator/rules/dynamics.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace pictura {
namespace {

const ClassLimits kVehicle = class_limits(AgentClass::vehicle);

TEST(Dynamics, FollowsTheReferenceTrajectory) {
  // Values computed in double by the public reference implementation: wheelbase 2.7 m, start at 5 m/s.
  struct Row {
    int step;
    float x, y, heading, v, a_long, a_lat, steer;
  };
  const std::vector<Row> rows{
      {1, 0.500995f, 0.001992f, 0.007952f, 5.02f, 0.4f, 0.4f, 0.042830f},
      {5, 2.581169f, 0.110997f, 0.111998f, 5.5f, 2.0f, 2.0f, 0.176652f},
      {12, 6.914569f, 1.056215f, 0.269199f, 7.215f, 2.5f, 0.4f, 0.020744f},
      {20, 12.201270f, 2.334151f, 0.125878f, 5.29f, -5.0f, -2.314504f, -0.219706f},
      {26, 14.463208f, 2.283862f, -0.225313f, 2.29f, -5.0f, -1.190809f, -0.55f},
  };
  std::vector<int> actions;
  actions.insert(actions.end(), 5, 11);
  actions.insert(actions.end(), 3, 10);
  actions.insert(actions.end(), 4, 6);
  actions.insert(actions.end(), 8, 0);
  actions.insert(actions.end(), 6, 1);
  Motion m;
  m.speed_mps = 5;
  size_t row = 0;
  for (size_t step = 1; step <= actions.size(); ++step) {
    m = move(m, controls_of_action(actions[step - 1]), {}, kVehicle, 0.1f);
    if (static_cast<int>(step) != rows[row].step) continue;
    EXPECT_NEAR(m.x_m, rows[row].x, 1e-4) << step;
    EXPECT_NEAR(m.y_m, rows[row].y, 1e-4) << step;
    EXPECT_NEAR(m.heading_rad, rows[row].heading, 1e-5) << step;
    EXPECT_NEAR(m.speed_mps, rows[row].v, 1e-5) << step;
    EXPECT_NEAR(m.accel_long_mps2, rows[row].a_long, 1e-5) << step;
    EXPECT_NEAR(m.accel_lat_mps2, rows[row].a_lat, 2e-5) << step;
    EXPECT_NEAR(m.steer_rad, rows[row].steer, 1e-5) << step;
    ++row;
  }
  EXPECT_EQ(row, rows.size());
}

TEST(Dynamics, StopsAtZeroBeforeItReverses) {
  Motion m;
  m.speed_mps = 0.1f;
  m.accel_long_mps2 = -5;
  m = move(m, {}, {}, kVehicle, 0.1f);
  EXPECT_EQ(m.speed_mps, 0.0f);
  m = move(m, {}, {}, kVehicle, 0.1f);
  EXPECT_FLOAT_EQ(m.speed_mps, -0.5f);
  for (int i = 0; i < 20; ++i) m = move(m, {}, {}, kVehicle, 0.1f);
  EXPECT_EQ(m.speed_mps, -2.0f);
}

TEST(Dynamics, ResetAtStandstillEndsTheAccelerationWhereTheSpeedChangesItsSign) {
  const DynamicsParameters resets{.rules = {.reset_at_standstill = true}};
  Motion m;
  m.speed_mps = 0.1f;
  m.accel_long_mps2 = -5;
  m.steer_rad = 0.2f;
  m = move(m, {}, resets, kVehicle, 0.1f);
  EXPECT_EQ(m.speed_mps, 0.0f);
  EXPECT_EQ(m.accel_long_mps2, 0.0f);
  EXPECT_EQ(m.accel_lat_mps2, 0.0f);
  EXPECT_FLOAT_EQ(m.jerk_long_mps3, 50.0f);  // from -5 to 0 m/s2 in 0.1 s
  EXPECT_NEAR(m.x_m, 0.5 * 0.1 * 0.1, 1e-6);
  m = move(m, {}, resets, kVehicle, 0.1f);  // the agent stays in place
  EXPECT_EQ(m.speed_mps, 0.0f);
  m = move(m, {-4, 0}, resets, kVehicle, 0.1f);  // then reverses: 0.5 x 0.4 m/s2 x 0.1 s
  EXPECT_FLOAT_EQ(m.speed_mps, -0.02f);
  EXPECT_FLOAT_EQ(m.accel_long_mps2, -0.4f);
  // Going forwards from reverse: -0.02 + 0.5 x (2.5 + 2.5) x 0.1 > 0.
  m.accel_long_mps2 = 2.5f;
  m = move(m, {}, resets, kVehicle, 0.1f);
  EXPECT_EQ(m.speed_mps, 0.0f);
  EXPECT_EQ(m.accel_long_mps2, 0.0f);
}

TEST(Dynamics, WithoutAChangeOfSignNothingIsReset) {
  Motion a, b;
  a.speed_mps = b.speed_mps = 3;
  for (int step = 0; step < 12; ++step) {
    const Controls controls = controls_of_action(step < 6 ? 10 : 4);  // never slower than 2 m/s
    a = move(a, controls, {}, kVehicle, 0.1f);
    b = move(b, controls, {.rules = {.reset_at_standstill = true}}, kVehicle, 0.1f);
    ASSERT_GT(a.speed_mps, 2.0f);
    EXPECT_EQ(a.speed_mps, b.speed_mps);
    EXPECT_EQ(a.accel_long_mps2, b.accel_long_mps2);
    EXPECT_EQ(a.x_m, b.x_m);
  }
}

TEST(Dynamics, RespectsLimitsAndMultipliers) {
  Motion m;
  const DynamicsParameters strong{1.0f, 1.0f, 1.5f, 2.7f};
  for (int i = 0; i < 200; ++i) m = move(m, {4, 0}, strong, kVehicle, 0.1f);
  EXPECT_FLOAT_EQ(m.accel_long_mps2, 3.75f);
  EXPECT_EQ(m.speed_mps, 20.0f);
  const Motion soft = move({}, {4, 0}, {0.5f, 1, 1, 2.7f}, kVehicle, 0.1f);
  EXPECT_FLOAT_EQ(soft.accel_long_mps2, 0.2f);
  EXPECT_FLOAT_EQ(soft.jerk_long_mps3, 2.0f);
}

TEST(Dynamics, TurnsOnACircleOfTheSteeringAngle) {
  // At a constant steering angle the rear axle runs on a circle of radius wheelbase / tan(steer).
  Motion m;
  m.speed_mps = 5;
  m.steer_rad = 0.3f;
  const float radius = 2.7f / std::tan(0.3f);
  for (int i = 0; i < 50; ++i) {
    m.accel_lat_mps2 = square(m.speed_mps) / radius;
    m = move(m, {}, {}, kVehicle, 0.1f);
    EXPECT_NEAR(std::hypot(m.x_m, m.y_m - radius), radius, 1e-3);
  }
}

TEST(Dynamics, ActionsAreLongTimesThreePlusLat) {
  EXPECT_EQ(controls_of_action(0).jerk_long_mps3, -15.0f);
  EXPECT_EQ(controls_of_action(0).jerk_lat_mps3, -4.0f);
  EXPECT_EQ(controls_of_action(7).jerk_long_mps3, 0.0f);
  EXPECT_EQ(controls_of_action(7).jerk_lat_mps3, 0.0f);
  EXPECT_EQ(controls_of_action(11).jerk_long_mps3, 4.0f);
  EXPECT_EQ(controls_of_action(11).jerk_lat_mps3, 4.0f);
}

}  // namespace
}  // namespace pictura
