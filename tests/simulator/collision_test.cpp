#include "pictura/simulator/rules/collision.h"

#include <gtest/gtest.h>

#include "pictura/common/rng.h"
#include "pictura/tests/simulator/stage.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

AgentBox make_box(float x, float y, float heading_rad = 0, float length_m = 4, float width_m = 2) {
  AgentBox box;
  box.center_m = {x, y, 0};
  box.cos_heading = cos_of(heading_rad);
  box.sin_heading = sin_of(heading_rad);
  box.length_m = length_m;
  box.width_m = width_m;
  box.height_m = 1.5f;
  return box;
}

bool contains(const OrientedBox& box, Vec2 p) {
  const Vec2 d = p - box.center_m;
  return std::abs(dot(d, box.forward)) <= box.half_length_m && std::abs(cross(box.forward, d)) <= box.half_width_m;
}

/// Whether a point of a dense grid over `a` (its rim included) lies in `b`.
bool overlap_by_points(const OrientedBox& a, const OrientedBox& b) {
  constexpr int kPoints = 80;
  for (int i = 0; i <= kPoints; ++i) {
    for (int j = 0; j <= kPoints; ++j) {
      const Vec2 p = a.center_m + a.forward * (a.half_length_m * (2.0f * static_cast<float>(i) / kPoints - 1)) +
                     left_normal(a.forward) * (a.half_width_m * (2.0f * static_cast<float>(j) / kPoints - 1));
      if (contains(b, p)) return true;
    }
  }
  return false;
}

TEST(Collision, OverlapAgreesWithPoints) {
  RandomStream random({.seed = 1, .purpose = Purpose::town});
  int overlaps = 0, undecided = 0;
  for (int i = 0; i < 400; ++i) {
    const OrientedBox a =
        footprint(make_box(0, 0, random.uniform(-3, 3), random.uniform(1, 6), random.uniform(0.5f, 2)));
    OrientedBox b = footprint(make_box(random.uniform(-5, 5), random.uniform(-4, 4), random.uniform(-3, 3),
                                       random.uniform(1, 6), random.uniform(0.5f, 2)));
    // Points miss overlaps thinner than their spacing: such overlaps are excluded.
    OrientedBox smaller = b, larger = b;
    smaller.half_length_m -= 0.1f;
    smaller.half_width_m -= 0.1f;
    larger.half_length_m += 0.1f;
    larger.half_width_m += 0.1f;
    const bool surely = overlap_by_points(a, smaller), perhaps = overlap_by_points(a, larger);
    if (surely != perhaps) {
      ++undecided;
      continue;
    }
    overlaps += surely;
    EXPECT_EQ(overlap(a, b), surely) << i;
    EXPECT_EQ(overlap(b, a), surely) << i;
  }
  EXPECT_GT(overlaps, 50);
  EXPECT_LT(undecided, 100);
}

TEST(Collision, NothingTunnelsHeadOn) {
  // Two cyclists, 1.6 x 0.5 m, pass through each other within one step: each travels 2 m.
  const AgentBox a_from = make_box(0, 0, 0, 1.6f, 0.5f), a_to = make_box(2, 0, 0, 1.6f, 0.5f);
  const AgentBox b_from = make_box(2, 0.2f, kPi, 1.6f, 0.5f), b_to = make_box(0, 0.2f, kPi, 1.6f, 0.5f);
  EXPECT_FALSE(overlap(footprint(a_to), footprint(b_to)));
  EXPECT_TRUE(collide(a_from, a_to, b_from, b_to));
  // A pedestrian stands on a car's path: hit between the poses, free at both of them.
  const AgentBox walker = make_box(3.2f, 0, 0, 0.4f, 0.4f);
  EXPECT_TRUE(collide(make_box(0, 0), make_box(2, 0), walker, walker));
  EXPECT_FALSE(
      collide(make_box(0, 0), make_box(2, 0), make_box(3.2f, 3, 0, 0.4f, 0.4f), make_box(3.2f, 3, 0, 0.4f, 0.4f)));
}

TEST(Collision, SweptAt20MetresPerSecondAcrossAThinBox) {
  // A car at 20 m/s crosses a thin standing box sideways: no contact before or after the step.
  const AgentBox thin = make_box(0, 0, 0, 0.4f, 0.4f);
  const AgentBox from = make_box(0, -1.21f, kHalfPi, 1.6f, 0.5f), to = make_box(0, 1.21f, kHalfPi, 1.6f, 0.5f);
  EXPECT_FALSE(overlap(footprint(thin), footprint(from)));
  EXPECT_FALSE(overlap(footprint(thin), footprint(to)));
  EXPECT_TRUE(collide(from, to, thin, thin));
  EXPECT_TRUE(collide(thin, thin, from, to));
}

TEST(Collision, BoxesOnDifferentLevelsDoNotCollide) {
  AgentBox below = make_box(0, 0), above = make_box(1, 0);
  above.center_m.z = 5;
  EXPECT_FALSE(collide(below, below, above, above));
  above.center_m.z = 1;
  EXPECT_TRUE(collide(below, below, above, above));
}

TEST(Collision, FaultFollowsThePaper) {
  const AgentBox own = make_box(0, 0);
  EXPECT_TRUE(at_fault(own, 5, make_box(4, 0)));           // rammed the one ahead
  EXPECT_TRUE(at_fault(own, 5, make_box(0, 2, kHalfPi)));  // side against side
  EXPECT_FALSE(at_fault(own, 0.1f, make_box(4, 0)));       // stood still
  EXPECT_FALSE(at_fault(own, -0.1f, make_box(-4, 0)));
  EXPECT_FALSE(at_fault(own, 5, make_box(-4.1f, 0.8f)));  // struck from behind
  EXPECT_TRUE(at_fault(own, -1, make_box(-4, 0)));        // backed into it
}

TEST(Collision, FaultIsJudgedByTheRearPlaneBeforeTheStep) {
  const AgentBox own = make_box(0, 0);
  // A cyclist whose front stands 5 cm behind the bumper, at the corner: more than 45 degrees off straight back.
  EXPECT_FALSE(at_fault(own, 5, make_box(-2.9f, 1.2f, 0, 1.7f, 0.6f)));
  EXPECT_FALSE(at_fault(own, 5, make_box(-2.9f, -1.2f, 0, 1.7f, 0.6f)));
  // Beside the bumper it is a side hit.
  EXPECT_TRUE(at_fault(own, 5, make_box(-2.7f, 1.4f, 0, 1.7f, 0.6f)));
  // Head on, both are at fault.
  EXPECT_TRUE(at_fault(own, 5, make_box(4.1f, 0.5f, kPi)));
  EXPECT_TRUE(at_fault(make_box(4.1f, 0.5f, kPi), 5, own));
  // From the side into the middle, and from the side behind the bumper.
  EXPECT_TRUE(at_fault(own, 5, make_box(-1, 3.1f, -kHalfPi)));
  EXPECT_FALSE(at_fault(own, 5, make_box(-2.5f, 3.1f, -kHalfPi)));
  // Reversing into the other's rear counts as coming from behind too.
  EXPECT_FALSE(at_fault(own, 5, make_box(-4.1f, 0, kPi)));
  // The rules are the same in every direction.
  EXPECT_FALSE(at_fault(
      make_box(7, 3, 2), 5,
      make_box(7 - 2.9f * cos_of(2) - 1.2f * sin_of(2), 3 - 2.9f * sin_of(2) + 1.2f * cos_of(2), 2, 1.7f, 0.6f)));
}

TEST(Collision, OnlyTheRammerIsAtFaultForARearEndCollisionAtSpeed) {
  // Bumpers 0.1 m apart, 1.5 m aside: the rammer ends 1.4 m inside the other box. The other's centre is then beside
  // the rammer's bumper rather than behind it.
  testing::Stage stage(testing::stadium(200, 2), 2);
  stage.put(0, {50, 0.5f}, 0, 20);
  stage.put(1, {54.1f, 2}, 0, 5);
  stage.step();
  EXPECT_EQ(stage.events(0), kEventCollision | kEventAtFault);
  EXPECT_EQ(stage.events(1), kEventCollision);
}

TEST(Collision, OnlyACyclistAtTheRearCornerIsAtFault) {
  testing::Stage stage(testing::stadium(200, 2), 2);
  stage.worlds.state.agents.length_m[0] = 1.7f;
  stage.worlds.state.agents.width_m[0] = 0.6f;
  stage.put(0, {52.05f, 1.2f}, 0, 8);  // front at 53.41, the other's rear at 53.45
  stage.put(1, {54.25f, 0}, 0, 3);
  stage.step();
  EXPECT_EQ(stage.events(0), kEventCollision | kEventAtFault);
  EXPECT_EQ(stage.events(1), kEventCollision);
}

/// A straight road with an obstacle at x = 100, and a car at 20 m/s: 2 m a step, from any start in between.
struct At20MetresPerSecond : ::testing::Test {
  /// Returns the first event that the car meets on the way from x = 80 to x = 110, or kEventNone.
  int first_event(testing::Stage* stage, float phase_m) {
    stage->put(0, {80 + phase_m, 0}, 0, 20);
    for (int i = 0; i < 15; ++i) {
      stage->step();
      if (stage->events(0) != kEventNone) return stage->events(0);
    }
    return kEventNone;
  }
};

TEST_F(At20MetresPerSecond, AllCrossingsAreDetected) {
  auto map = testing::stadium(200, 1);
  testing::Stage free_road(map, 1), walker(map, 2);
  walker.worlds.state.agents.length_m[1] = walker.worlds.state.agents.width_m[1] = 0.4f;
  map = testing::stadium(200, 1);
  map->building_lines = {{{100, 1, 0}, {100, -1, 0}}};  // across the road; the first piece always stands
  testing::Stage wall(map, 1);
  map = testing::stadium(200, 1);
  map->road_edges.push_back({{100, 0.2f, 0}, {100, -0.2f, 0}});
  testing::Stage edge(map, 1);
  map = testing::stadium(200, 1);
  testing::add_light(map.get(), 100, 4, 1, {0});
  testing::Stage light(map, 1), waypoint(testing::stadium(200, 1), 1);
  light.worlds.state.lights[0] = LightState::red;
  waypoint.set(0, Conditioning::delta_goal_m, 0.5f);
  for (float phase_m = 0; phase_m < 2; phase_m += 0.1f) {
    SCOPED_TRACE(phase_m);
    EXPECT_EQ(first_event(&free_road, phase_m), kEventNone);
    walker.put(1, {100, 0.9f}, kHalfPi, 0);
    EXPECT_EQ(first_event(&walker, phase_m), kEventCollision | kEventAtFault);
    EXPECT_EQ(first_event(&wall, phase_m), kEventWall);
    EXPECT_EQ(first_event(&edge, phase_m), kEventOffRoad);
    EXPECT_EQ(first_event(&light, phase_m), kEventRedLight);
    waypoint.worlds.state.agents.waypoint_x_m[0] = 100;
    waypoint.worlds.state.agents.waypoint_y_m[0] = 0.45f;
    waypoint.worlds.state.agents.next_waypoint[0] = 0;
    EXPECT_EQ(first_event(&waypoint, phase_m), kEventWaypoint);
  }
}

TEST(Collision, SegmentTouchesBox) {
  const OrientedBox box = footprint(make_box(0, 0, 0.3f));
  EXPECT_TRUE(touches(box, {-10, 0}, {10, 0}));
  EXPECT_TRUE(touches(box, {0.1f, 0.1f}, {0.2f, 0.2f}));  // wholly inside
  EXPECT_FALSE(touches(box, {-10, 3}, {10, 3}));
  EXPECT_FALSE(touches(box, {3, 0}, {10, 0}));
  EXPECT_TRUE(touches(box, {0, 0}, {0, 0}));
}

TEST(Collision, BothHaltAndOnlyTheRammerIsAtFault) {
  testing::Stage stage(testing::stadium(200, 1), 3);
  stage.put(0, {50, 0}, 0, 10);
  stage.put(1, {54.5f, 0}, 0, 5);
  stage.put(2, {100, 0}, 0, 5);
  stage.set(0, Conditioning::collision, 2);
  const std::vector<float> rewards = stage.step();
  EXPECT_EQ(stage.events(0), kEventCollision | kEventAtFault);
  EXPECT_EQ(stage.events(1), kEventCollision);
  EXPECT_EQ(stage.events(2), kEventNone);
  EXPECT_EQ(stage.worlds.state.agents.status[0], AgentStatus::halted);
  EXPECT_EQ(stage.worlds.state.agents.status[1], AgentStatus::halted);
  EXPECT_EQ(stage.worlds.state.agents.speed_mps[0], 0);
  EXPECT_NEAR(rewards[0], -3, 0.01);
  EXPECT_NEAR(rewards[1], -0.5, 0.01);
  // Halted agents stay in the way and earn no further rewards.
  stage.put(2, {46.5f, 0}, 0, 10);
  const std::vector<float> later = stage.step();
  EXPECT_EQ(later[0], 0);
  EXPECT_EQ(stage.events(0), kEventNone);
  EXPECT_EQ(stage.events(2), kEventCollision | kEventAtFault);
}

}  // namespace
}  // namespace pictura
