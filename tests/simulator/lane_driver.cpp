#include "pictura/tests/simulator/lane_driver.h"

#include <algorithm>
#include <cmath>

#include "pictura/common/error.h"
#include "pictura/simulator/world_batch.h"
#include "pictura/tests/simulator/goal_places.h"

namespace pictura::testing {

namespace {

constexpr float kWayOn_m = 80;   // known beyond the last waypoint
constexpr float kMissed_m = 10;  // a waypoint so far behind has been missed

/// Pure pursuit.
float steer_to(Vec2 target, const Motion& now, float wheelbase_m) {
  const SinCos heading = sincos_of(now.heading_rad);
  const Vec2 apart = target - Vec2{now.x_m, now.y_m};
  const float left = cross({heading.cos, heading.sin}, apart);
  return std::atan(2 * left * wheelbase_m / std::max(dot(apart, apart), 1.0f));
}

}  // namespace

LaneDriver::LaneDriver(const WorldView& world, const LaneGraph& graph) : world_(world), graph_(graph) {
  const RoutePoint start = spawn_place(world_, 0);
  route_ = {{start.lane}};
  at_ = {0, start.s_m};
  waypoints_.back() = start;  // where the first chain starts
}

int32_t LaneDriver::act() {
  const AgentStateView& agents = world_.agents;
  const int slot = world_.first_slot;
  find_place({agents.x_m[slot], agents.y_m[slot]});
  const int32_t chain = agents.goal_chains[slot] - 1;
  PICTURA_CHECK(chain <= chain_ + 1, "lane driver: expected a look at every chain, got {} after {}", chain, chain_);
  if (chain != chain_) {
    waypoints_ = goal_places(world_, 0, static_cast<uint32_t>(chain), waypoints_.back());
    chain_ = chain;
    plan();
  } else if (travelled_m_ > to_waypoint_m_[agents.next_waypoint[slot]] + kMissed_m) {
    plan();
  } else if (is_too_late_to_change()) {
    give_up_change();
  }

  const Motion now = motion_of(agents, slot);
  const float wheelbase_m = kWheelbasePerLength * agents.length_m[slot];
  const float bumper_m = 0.8f * agents.length_m[slot];  // ahead of the rear axle
  const float wanted_steer = steer_to(target(std::clamp(2 + 0.6f * now.speed_mps, 2.0f, 10.0f)), now, wheelbase_m);
  const float wanted_mps = wanted_speed(now.speed_mps, bumper_m);
  // Jerks are too coarse to come to rest by ever smaller decelerations.
  const float wanted_accel = wanted_mps == 0 && now.speed_mps > 0 && now.speed_mps < 0.5f
                                 ? -1.0f
                                 : std::clamp((wanted_mps - now.speed_mps) / 0.6f, -4.0f, 1.5f);
  DynamicsParameters parameters;
  parameters.wheelbase_m = wheelbase_m;
  int32_t best = 0;
  float least = INFINITY;
  for (int32_t action = 0; action < kNumActions; ++action) {
    const auto step_from = [&](const Motion& from) {
      return move(from, controls_of_action(action), parameters, class_limits(class_of(agents, slot)),
                  world_.options.dt_s);
    };
    const Motion next = step_from(now);
    // An acceleration that changes its sign stops at zero for a step, so that steering shows in the second one alone.
    const float cost =
        10 * std::fabs(step_from(next).steer_rad - wanted_steer) + std::fabs(next.accel_long_mps2 - wanted_accel);
    if (cost >= least) continue;
    least = cost;
    best = action;
  }
  return best;
}

/// From where it is.
void LaneDriver::plan() {
  const int32_t here = route_[at_.index].lane;
  route_ = {{here}};
  at_ = {0, std::min(at_.s_m, lane(here).length_m)};
  go_on_from({here, at_.s_m}, 0);
}

/// Stays on the lane that it is on, not on the one that the route has changed to, and plans anew from where that ends.
void LaneDriver::give_up_change() {
  const int32_t here = world_.agents.lane[world_.first_slot], wanted = route_[at_.index].lane;
  const int32_t next = world_.map.successors[static_cast<size_t>(lane(here).first_successor)];
  at_ = {0, at_.s_m * lane(here).length_m / lane(wanted).length_m};
  route_ = {{here}, {next}};
  go_on_from({next, 0}, lane(here).length_m - at_.s_m);
}

/// Whether the route's lane ends before it has got there from a lane beside.
bool LaneDriver::is_too_late_to_change() const {
  constexpr float kAhead_m = 8;
  const int32_t here = world_.agents.lane[world_.first_slot], wanted = route_[at_.index].lane;
  return here >= 0 && is_beside(here, wanted) && lane(here).num_successors > 0 && still_aside_m() != 0 &&
         lane(wanted).length_m - at_.s_m < kAhead_m;
}

/// Whether lane changes lead from one to the other.
bool LaneDriver::is_beside(int32_t from, int32_t to) const {
  for (const bool left : {true, false}) {
    int32_t next = from;
    do {
      next = left ? lane(next).left : lane(next).right;
      if (next == to) return true;
    } while (next >= 0 && next != from);
  }
  return false;
}

/// Appends the way through the waypoints that are left, and on.
void LaneDriver::go_on_from(RoutePoint from, float planned_m) {
  travelled_m_ = 0;
  for (size_t i = static_cast<size_t>(world_.agents.next_waypoint[world_.first_slot]); i < kNumWaypoints; ++i) {
    const auto route = graph_.route(lane_place(world_.map, from), lane_place(world_.map, waypoints_[i]));
    if (!route) fail("lane driver: no route to waypoint {}", i);
    append_route(from, route->lanes);
    planned_m += static_cast<float>(route->length_m);
    to_waypoint_m_[i] = planned_m;
    from = waypoints_[i];
  }
  append_way_on(kWayOn_m);
}

/// Lanes as LaneRoute has them: it changes where it or a lane begins.
void LaneDriver::append_route(RoutePoint from, const std::vector<int32_t>& lanes) {
  float change_at_m = from.s_m;
  for (size_t i = 1; i < lanes.size(); ++i) {
    if (!is_change(lanes[i - 1], lanes[i])) change_at_m = 0;
    route_.push_back({lanes[i], change_at_m});
    change_at_m *= lane(lanes[i]).length_m / lane(lanes[i - 1]).length_m;
  }
}

void LaneDriver::append_way_on(float distance_m) {
  while (distance_m > 0 && lane(route_.back().lane).num_successors > 0) {
    const MapLane& last = lane(route_.back().lane);
    route_.push_back({world_.map.successors[static_cast<size_t>(last.first_successor)]});
    distance_m -= lane(route_.back().lane).length_m;
  }
}

LaneDriver::Mark LaneDriver::moved(Mark at, float distance_m) const {
  at.s_m += distance_m;
  for (; at.index + 1 < route_.size(); ++at.index) {
    const int32_t here = route_[at.index].lane, next = route_[at.index + 1].lane;
    if (!is_change(here, next)) {
      if (at.s_m <= lane(here).length_m) break;
      at.s_m -= lane(here).length_m;
      continue;
    }
    if (at.s_m < route_[at.index + 1].change_at_m) break;
    const LanePose before = pose_on_lane(world_.map, here, at.s_m);
    at.s_m *= lane(next).length_m / lane(here).length_m;
    const LanePose after = pose_on_lane(world_.map, next, at.s_m);
    const SinCos heading = sincos_of(before.heading_rad);
    at.moved_left_m += cross({heading.cos, heading.sin}, (after.position_m - before.position_m).xy());
  }
  return at;
}

/// Along its own lane, beside the route where that changes lanes ahead: it changes when it comes there.
LanePose LaneDriver::pose(float distance_m) const {
  const Mark at = moved(at_, distance_m);
  LanePose pose = pose_on_lane(world_.map, route_[at.index].lane, at.s_m);
  const SinCos heading = sincos_of(pose.heading_rad);
  const Vec2 aside = left_normal({heading.cos, heading.sin}) * at.moved_left_m;
  pose.position_m = pose.position_m - Vec3{aside.x, aside.y, 0};
  return pose;
}

/// To the left of the route on the way to another lane, beyond what one step of steering may ask for.
float LaneDriver::still_aside_m() const {
  constexpr float kAside_m = 1.5f;
  const LanePose here = pose(0);
  const SinCos heading = sincos_of(here.heading_rad);
  const Vec2 axle{world_.agents.x_m[world_.first_slot], world_.agents.y_m[world_.first_slot]};
  const float left_m = cross({heading.cos, heading.sin}, axle - here.position_m.xy());
  return left_m - std::clamp(left_m, -kAside_m, kAside_m);
}

/// How far to the left of that place of the route the car has as much room on either side.
float LaneDriver::middle_of_room_m(const LanePose& at) const {
  constexpr int kSteps = 8;
  constexpr float kStep_m = 0.1f;
  const SinCos heading = sincos_of(at.heading_rad);
  const Vec2 left = left_normal({heading.cos, heading.sin});
  const auto fits = [&](int step) {
    const Vec2 aside = left * (kStep_m * static_cast<float>(step));
    const Vec3 place = at.position_m + Vec3{aside.x, aside.y, 0};
    return !touches_barrier(world_.map, box_at(world_.agents, world_.first_slot, place, heading));
  };
  // From where it fits nearest to the route, to either side as far as it goes on fitting.
  int low = 0;
  for (int step = 1; step <= kSteps && !fits(low); ++step) low = fits(-step) ? -step : step;
  if (!fits(low)) return 0;
  int high = low;
  while (low > -kSteps && fits(low - 1)) --low;
  while (high < kSteps && fits(high + 1)) ++high;
  return 0.5f * kStep_m * static_cast<float>(low + high);
}

/// A place on the route, or beside it where there is room: in curves the rear cuts the inside and the front swings out.
Vec2 LaneDriver::target(float distance_m) const {
  const LanePose at = pose(distance_m);
  const SinCos heading = sincos_of(at.heading_rad);
  return at.position_m.xy() + left_normal({heading.cos, heading.sin}) * (middle_of_room_m(at) + still_aside_m());
}

/// Moves its place along the route to where it is nearest to the rear axle.
void LaneDriver::find_place(Vec2 axle) {
  constexpr float kReach_m = 3, kStep_m = 0.1f;
  float best_m = INFINITY, best_ahead_m = 0;
  for (float s = 0; s < kReach_m; s += kStep_m) {
    const float apart = length(pose(s).position_m.xy() - axle);
    if (apart >= best_m) continue;
    best_m = apart;
    best_ahead_m = s;
  }
  at_ = moved(at_, best_ahead_m);
  at_.moved_left_m = 0;
  travelled_m_ += best_ahead_m;
}

float LaneDriver::wanted_speed(float speed_mps, float bumper_m) {
  constexpr float kFastest_mps = 8, kChangingLanes_mps = 5;
  float wanted = std::min(0.8f * world_.agents.speed_limit_mps[world_.first_slot],
                          still_aside_m() != 0 ? kChangingLanes_mps : kFastest_mps);
  for (float s = 0; s < 24; s += 2) {
    const float turn = std::fabs(wrap_angle(pose(s + 2).heading_rad - pose(s).heading_rad));
    wanted = std::min(wanted, std::sqrt(square(std::sqrt(1.5f / (turn / 2 + 1e-3f))) + 2 * 1.0f * s));
  }
  constexpr float kMargin_m = 2.0f;
  const float gap_m = to_closed_line(speed_mps, bumper_m) - kMargin_m;
  stops_ += gap_m < 1 && speed_mps < 0.1f;
  return std::min(wanted, std::sqrt(2 * 1.5f * std::max(gap_m, 0.0f)));
}

/// From the bumper along the route to the next line that is red, or yellow and can still be stopped at; 1000 where none
/// is near.
float LaneDriver::to_closed_line(float speed_mps, float bumper_m) const {
  constexpr float kLook_m = 45, kStep_m = 0.5f;
  const Vec2 here = pose(0).position_m.xy();
  std::vector<size_t> near;
  for (size_t light = 0; light < world_.map.stop_lines.size(); ++light) {
    const LightState state = world_.lights[light];
    const bool closes = state == LightState::red || state == LightState::yellow;
    if (closes && length(world_.map.stop_lines[light].middle_m.xy() - here) < kLook_m + 10) near.push_back(light);
  }
  if (near.empty()) return 1000;
  for (float s = bumper_m; s < kLook_m; s += kStep_m) {
    const LanePose a = pose(s), b = pose(s + kStep_m);
    const SinCos heading = sincos_of(b.heading_rad);
    for (const size_t light : near) {
      const StopLine& line = world_.map.stop_lines[light];
      const bool can_stop = s - bumper_m > 0.5f * square(speed_mps) / 3.0f;
      if (world_.lights[light] == LightState::yellow && !can_stop) continue;
      const Vec2 from = a.position_m.xy() - line.middle_m.xy(), to = b.position_m.xy() - line.middle_m.xy();
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

std::vector<DrivenEpisode> drive_lanes(const std::shared_ptr<const RoadMap>& map, SimulatorConfig config,
                                       int num_worlds, int steps) {
  config.pedestrian_fraction = 0;
  config.parked_cars = 0;
  config.fixed_lights = true;
  config.vector_observations = false;
  config.episode_steps = steps + 1;
  config.reset_inactive_fraction = 2;  // a world whose driver has halted stays as it is
  config.conditioning[static_cast<size_t>(Conditioning::delta_goal_m)] = {2, 2, false};
  for (size_t c = kNumRewardConditioning; c < kNumConditioning; ++c) config.conditioning[c] = {1, 1, false};
  std::vector<WorldSpec> specs;
  for (int w = 0; w < num_worlds; ++w) specs.push_back({0, 1, static_cast<uint32_t>(w)});
  const auto simulator = make_simulator("cpu", config, {map}, specs);
  // The drivers' eyes: the same map, over the simulator's agents and lights.
  WorldBatch batch(config, {map}, specs);
  batch.restore(simulator->save());
  const LaneGraph graph(*map);
  std::vector<LaneDriver> drivers;
  for (int w = 0; w < num_worlds; ++w) {
    WorldView view = batch.world(w);
    view.agents = simulator->state();
    view.lights = const_cast<LightState*>(simulator->scene().light_states.data()) +
                  simulator->scene().light_begin[static_cast<size_t>(w)];
    drivers.emplace_back(view, graph);
  }
  const AgentStateView state = simulator->state();
  std::vector<int32_t> actions(drivers.size());
  for (int step = 0; step < steps; ++step) {
    for (size_t w = 0; w < drivers.size(); ++w) {
      const bool drives = state.status[w] == static_cast<uint8_t>(AgentStatus::active);
      actions[w] = drives ? drivers[w].act() : 0;
    }
    simulator->step(actions);
  }
  std::vector<DrivenEpisode> episodes;
  for (size_t w = 0; w < drivers.size(); ++w) {
    episodes.push_back({state.goals_reached[w],
                        state.halt_reason[w],
                        drivers[w].stops(),
                        state.distance_m[w],
                        {state.x_m[w], state.y_m[w]}});
  }
  return episodes;
}

}  // namespace pictura::testing
