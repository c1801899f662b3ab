// A driver that keeps its lane and stops at red lights, alone in every town: what the rules ask for can be driven with
// the jerk actions, and keeping to them causes no infraction.
#include <cmath>

#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/simulator/rules/spawn.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/world_batch.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

/// Follows one route through the lanes: at each fork a successor from which the route goes on for ever.
class LaneDriver {
 public:
  LaneDriver(const WorldView& world, int choice) : world_(world), choice_(choice) {
    at_.lane = world.agents.lane[world.first_slot];
  }

  int stops() const { return stops_; }

  /// The action for what the agent and the lights are now.
  int32_t act() {
    const AgentStateView& agents = world_.agents;
    const int slot = world_.first_slot;
    find_place({agents.x_m[slot], agents.y_m[slot]});
    const Motion now = motion_of(agents, slot);
    const float wheelbase_m = kWheelbasePerLength * agents.length_m[slot];
    const float bumper_m = 0.8f * agents.length_m[slot];  // ahead of the rear axle
    const float wanted_steer =
        steer_to(target(clamp(2 + 0.6f * now.speed_mps, 2.0f, 10.0f), bumper_m), now, wheelbase_m);
    const float wanted_mps = wanted_speed(now.speed_mps, bumper_m);
    // Jerks are too coarse to come to rest by ever smaller decelerations.
    const float wanted_accel = wanted_mps == 0 && now.speed_mps > 0 && now.speed_mps < 0.5f
                                   ? -1.0f
                                   : clamp((wanted_mps - now.speed_mps) / 0.6f, -4.0f, 1.5f);
    DynamicsParameters parameters;
    parameters.wheelbase_m = wheelbase_m;
    int32_t best = 0;
    float least = INFINITY;
    for (int32_t action = 0; action < kNumActions; ++action) {
      const Motion next =
          move(now, controls_of_action(action), parameters, class_limits(class_of(agents, slot)), world_.options.dt_s);
      const float cost = 10 * std::fabs(next.steer_rad - wanted_steer) + std::fabs(next.accel_long_mps2 - wanted_accel);
      if (cost >= least) continue;
      least = cost;
      best = action;
    }
    return best;
  }

 private:
  RoutePoint moved(RoutePoint at, float distance_m) const {
    at.s_m += distance_m;
    for (int i = 0; i < 32; ++i) {
      const MapLane& lane = world_.map.lanes[static_cast<size_t>(at.lane)];
      if (at.s_m <= lane.length_m || lane.num_successors == 0) break;
      at.s_m -= lane.length_m;
      at.lane = world_.map.successors[static_cast<size_t>(lane.first_successor + choice_ % lane.num_successors)];
    }
    return at;
  }
  LanePose pose(float distance_m) const {
    const RoutePoint at = moved(at_, distance_m);
    return pose_on_lane(world_.map, at.lane, at.s_m);
  }
  Vec2 ahead(float distance_m) const { return pose(distance_m).position_m.xy(); }

  /// A place on the route, moved to the inside of curves, where the front swings out.
  Vec2 target(float distance_m, float bumper_m) const {
    constexpr float kAlong_m = 4;
    const LanePose from = pose(distance_m), to = pose(distance_m + kAlong_m);
    const float curvature = wrap_angle(to.heading_rad - from.heading_rad) / kAlong_m;
    const SinCos heading = sincos_of(from.heading_rad);
    return from.position_m.xy() +
           left_normal({heading.cos, heading.sin}) * clamp(0.1f * square(bumper_m) * curvature, -0.8f, 0.8f);
  }

  /// Moves its place along the route to where it is nearest to the rear axle.
  void find_place(Vec2 axle) {
    const float reach_m = is_placed_ ? 3.0f : 500.0f;
    float best_m = INFINITY, best_ahead_m = 0;
    for (float s = 0; s < std::min(reach_m, is_placed_ ? reach_m : lane_length()); s += 0.1f) {
      const float apart = length(ahead(s) - axle);
      if (apart >= best_m) continue;
      best_m = apart;
      best_ahead_m = s;
    }
    at_ = moved(at_, best_ahead_m);
    is_placed_ = true;
  }
  float lane_length() const { return world_.map.lanes[static_cast<size_t>(at_.lane)].length_m; }

  /// Pure pursuit.
  static float steer_to(Vec2 target, const Motion& now, float wheelbase_m) {
    const SinCos heading = sincos_of(now.heading_rad);
    const Vec2 apart = target - Vec2{now.x_m, now.y_m};
    const float left = cross({heading.cos, heading.sin}, apart);
    return std::atan(2 * left * wheelbase_m / std::max(dot(apart, apart), 1.0f));
  }

  float wanted_speed(float speed_mps, float bumper_m) {
    float wanted = std::min(0.8f * world_.agents.speed_limit_mps[world_.first_slot], 8.0f);
    for (float s = 0; s < 24; s += 2) {
      const float turn = std::fabs(wrap_angle(pose(s + 2).heading_rad - pose(s).heading_rad));
      wanted = std::min(wanted, std::sqrt(square(std::sqrt(1.5f / (turn / 2 + 1e-3f))) + 2 * 1.0f * s));
    }
    constexpr float kMargin_m = 2.0f;
    const float gap_m = to_closed_line(speed_mps, bumper_m) - kMargin_m;
    stops_ += gap_m < 1 && speed_mps < 0.1f;
    return std::min(wanted, std::sqrt(2 * 1.5f * std::max(gap_m, 0.0f)));
  }

  /// From the bumper along the route to the next line that is red, or yellow and can still be stopped at; 1000 where
  /// none is near.
  float to_closed_line(float speed_mps, float bumper_m) const {
    for (float s = bumper_m; s < 45; s += 0.5f) {
      const LanePose a = pose(s), b = pose(s + 0.5f);
      for (size_t light = 0; light < world_.map.stop_lines.size(); ++light) {
        const StopLine& line = world_.map.stop_lines[light];
        const LightState state = world_.lights[light];
        const bool can_stop = s - bumper_m > 0.5f * square(speed_mps) / 3.0f;
        if (state != LightState::red && (state != LightState::yellow || !can_stop)) continue;
        const Vec2 from = a.position_m.xy() - line.middle_m.xy(), to = b.position_m.xy() - line.middle_m.xy();
        if (std::fabs(from.x) > 10 || std::fabs(from.y) > 10) continue;
        const SinCos heading = sincos_of(b.heading_rad);
        if (dot(from, line.direction) < 0 && dot(to, line.direction) >= 0 &&
            std::fabs(cross(line.direction, to)) <= line.half_length_m + 0.5f &&
            heading.cos * line.direction.x + heading.sin * line.direction.y > 0.7f &&
            std::fabs(line.middle_m.z - b.position_m.z) < kLevel_m) {
          return s - bumper_m;
        }
      }
    }
    return 1000;
  }

  const WorldView world_;
  int choice_;
  RoutePoint at_;
  bool is_placed_ = false;
  int stops_ = 0;
};

/// Drives in every town, in sixteen worlds of it, each alone, for 45 s. No event but the `harmless` ones may halt a
/// driver, and those at most half of them.
void drive_everywhere(float cyclist_fraction, int harmless) {
  std::vector<std::string> towns = known_towns();
  for (const char* town : {"procedural:1", "procedural:2"}) towns.emplace_back(town);
  for (const std::string& town : towns) {
    SCOPED_TRACE(town);
    SimulatorConfig config = testing::cars();
    config.walls = false;
    config.cyclist_fraction = cyclist_fraction;
    config.fixed_lights = true;
    config.vector_observations = false;
    config.num_threads = 1;
    config.reset_inactive_fraction = 2;  // a world whose driver has halted stays as it is
    for (size_t c = kNumRewardConditioning; c < kNumConditioning; ++c) config.conditioning[c] = {1, 1, false};
    constexpr int kDrivers = 16, kSteps = 450;
    std::vector<WorldSpec> specs;
    for (uint32_t w = 0; w < kDrivers; ++w) specs.push_back({0, 1, w});
    const auto map = load_map(town);
    const auto simulator = make_simulator("cpu", config, {map}, specs);
    // The drivers' eyes: the same maps, over the simulator's agents and lights.
    WorldBatch batch(config, {map}, specs);
    batch.restore(simulator->save());
    std::vector<LaneDriver> drivers;
    for (int w = 0; w < kDrivers; ++w) {
      WorldView view = batch.world(w);
      view.agents = simulator->state();
      view.lights = const_cast<LightState*>(simulator->scene().light_states.data()) +
                    simulator->scene().light_begin[static_cast<size_t>(w)];
      drivers.emplace_back(view, w);
    }
    std::vector<int32_t> actions(kDrivers);
    for (int step = 0; step < kSteps; ++step) {
      for (size_t w = 0; w < kDrivers; ++w) {
        const bool drives = simulator->state().status[w] == static_cast<uint8_t>(AgentStatus::active);
        actions[w] = drives ? drivers[w].act() : 0;
      }
      simulator->step(actions);
    }
    int stops = 0, halted = 0;
    for (size_t w = 0; w < kDrivers; ++w) {
      stops += drivers[w].stops();
      halted += simulator->state().halt_reason[w] != 0;
      EXPECT_EQ(simulator->state().halt_reason[w] & ~harmless, 0)
          << "driver " << w << " at " << simulator->state().x_m[w] << ' ' << simulator->state().y_m[w];
    }
    EXPECT_LE(halted, kDrivers / 2);
    EXPECT_GT(simulator->totals().distance_m, kDrivers * 100);
    if (!map->lights.empty()) {
      EXPECT_GT(stops, 0) << "nobody ever waited at a red light";
    }
  }
}

TEST(Driver, OfABicycleKeepsItsLaneAndStopsAtRedLightsInEveryTown) { drive_everywhere(1, kEventNone); }

// The longest cars cannot take the tightest curves on their lane's centre line without touching the kerb.
TEST(Driver, OfACarStopsAtRedLightsInEveryTown) { drive_everywhere(0, kEventOffRoad); }

}  // namespace
}  // namespace pictura
