#include "pictura/simulator/controllers/lane_keeping.h"

#include <algorithm>
#include <cmath>

#include "pictura/common/error.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/simulator/controllers/goal_places.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/simulator_setup.h"

namespace pictura {

namespace {

constexpr float kWayOn_m = 80;   // length of the path beyond the last waypoint
constexpr float kMissed_m = 10;  // a waypoint this far behind has been missed
constexpr float kStanding_mps = 0.1f;

/// Returns the index of the first box that touches `other`, or the number of boxes.
size_t first_touching(const std::vector<AgentBox>& boxes, const AgentBox& other) {
  const auto touches = [&other](const AgentBox& box) {
    const Vec2 apart = (box.center_m - other.center_m).xy();
    return dot(apart, apart) <= square(radius(box) + radius(other)) && same_level(box, other) &&
           overlap(footprint(box), footprint(other));
  };
  return static_cast<size_t>(std::find_if(boxes.begin(), boxes.end(), touches) - boxes.begin());
}

}  // namespace

LaneKeepingAgent::LaneKeepingAgent(const WorldView& world, int agent, const LaneGraph& graph, size_t search_nodes)
    : world_(world),
      self_(agent),
      slot_(world.first_slot + agent),
      life_(world.agents.life[slot_]),
      agent_(world, agent),
      path_(world.map, graph, start_place(world, agent)),
      max_search_nodes_(world.map.is_open ? kMaxSearchNodesOfOpen : kMaxSearchNodes),
      search_nodes_(search_nodes) {
  waypoints_.back() = points().front().at;  // start of the first chain
}

int32_t LaneKeepingAgent::act() {
  search_nodes_ = std::min(search_nodes_ + kSearchNodesPerStep, max_search_nodes_);
  find_place();
  follow_goals();
  const Motion now = agent_.now();
  const float max_mps = std::min(speed_before_light(now), speed_behind_others());
  bool is_safe = false;
  if (max_mps < kPlannedSpeed_mps) {
    drop_plan();
  } else if (next_planned_ % kStrideSteps == 0 || next_planned_ >= plan_.actions.size()) {
    is_safe = renew_plan(now);
  } else {
    is_safe = is_plan_safe();
  }
  const bool is_planned = next_planned_ < plan_.actions.size();
  const int32_t action = is_planned ? plan_.actions[next_planned_]
                                    : pursuing_action(now, place_, std::min(points()[place_].speed_mps, max_mps));
  if (is_safe) {
    halts_ = false;
    min_search_nodes_ = 0;
  } else if (halts_ || !can_stop_after(now, action)) {
    halts_ = true;
    drop_plan();
    return braking_action(now);
  }
  next_planned_ += is_planned;
  return action;
}

/// Updates the plan and returns whether the next action keeps the agent on the road. If the agent stays on the road by
/// following its path, there is no plan. A plan is replaced only after half of it. A halted agent searches with twice
/// the budget after each failed search, until a search fails although it does not use up its budget.
bool LaneKeepingAgent::renew_plan(const Motion& now) {
  if (stays_on_road(now, action_of(Driving::pursues, now, place_), Driving::pursues)) {
    drop_plan();
    return true;
  }
  if (next_planned_ < plan_.actions.size() / 2) return plan_.is_clear;
  const bool brakes = halts_ && std::fabs(now.speed_mps) > kStanding_mps;
  const size_t had_nodes = search_nodes_;
  if (brakes || had_nodes < min_search_nodes_) return false;
  DrivingPlan plan = search_steering(agent_, points(), place_, &search_nodes_);
  if (!plan.is_clear) plan = plan_elsewhere(std::move(plan));
  const bool is_cut_off = search_nodes_ == 0;
  if (halts_) {
    min_search_nodes_ = is_cut_off ? std::min(2 * had_nodes, max_search_nodes_) : SIZE_MAX;
  } else {
    min_search_nodes_ = is_cut_off ? std::min(kMinSearchNodes, max_search_nodes_) : 0;
  }
  if (plan.is_clear || plan.actions.size() > plan_.actions.size() - next_planned_) {
    plan_ = std::move(plan);
    next_planned_ = 0;
  }
  return is_plan_safe();
}

void LaneKeepingAgent::drop_plan() {
  plan_ = {};
  next_planned_ = 0;
}

/// Extends the path to the waypoints of a new chain, or replaces it if the agent missed a waypoint.
void LaneKeepingAgent::follow_goals() {
  const int32_t chain = world_.agents.goal_chains[slot_] - 1;
  PICTURA_CHECK(chain <= chain_ + 1, "lane keeping: expected consecutive goal chains, got {} after {}", chain, chain_);
  if (chain != chain_) {
    waypoints_ = goal_places(world_, self_, static_cast<uint32_t>(chain), waypoints_.back());
    chain_ = chain;
    path_.cut(std::max(goals_.back(), place_));
    plan();
  } else if (place_ + 1 >= points().size() || place_ > ahead(goals_[world_.agents.next_waypoint[slot_]], kMissed_m)) {
    path_.cut(place_);
    plan();
  }
}

/// Extends the path from its end through the remaining waypoints and kWayOn_m beyond.
void LaneKeepingAgent::plan() {
  for (auto i = static_cast<size_t>(world_.agents.next_waypoint[slot_]); i < kNumWaypoints; ++i) {
    const bool gets_there = path_.go_to(waypoints_[i]);
    for (size_t goal = i; goal < kNumWaypoints; ++goal) goals_[goal] = points().size() - 1;
    if (!gets_there) break;
  }
  // The next chain is unknown, so the agent must be slow enough to turn after the last waypoint.
  constexpr float kTurn_m = 20, kTurning_mps = 3;
  const bool may_turn = path_.forks_within(kTurn_m);
  path_.go_on(kWayOn_m);
  path_.limit_speeds(goals_.back(), may_turn ? kTurning_mps : INFINITY);
}

/// Tries another path if a turn cannot be driven. If there is a clear plan along the straightest lanes, these become
/// the path and that plan is returned; otherwise `plan` is returned. The path later continues from there to the
/// waypoints.
DrivingPlan LaneKeepingAgent::plan_elsewhere(DrivingPlan plan) {
  constexpr float kPassed_m = 20;
  LanePath other = path_;
  other.cut(place_);
  other.go_on(kWayOn_m);
  other.limit_speeds(place_, INFINITY);
  DrivingPlan straight = search_steering(agent_, other.points(), place_, &search_nodes_);
  if (!straight.is_clear) return plan;
  path_ = std::move(other);
  goals_.fill(ahead(place_, kPassed_m));
  return straight;
}

size_t LaneKeepingAgent::ahead(size_t from, float distance_m) const {
  return std::min(from + static_cast<size_t>(distance_m / LanePath::kSpacing_m), points().size() - 1);
}

/// Moves place_ forward to the point of the path nearest to the rear axle.
void LaneKeepingAgent::find_place() {
  constexpr float kReach_m = 3;
  const Motion now = agent_.now();
  const size_t last = ahead(place_, kReach_m);
  float best_m = INFINITY;
  for (size_t i = place_; i <= last; ++i) {
    const float apart_m = length(points()[i].position_m.xy() - Vec2{now.x_m, now.y_m});
    if (apart_m >= best_m) continue;
    best_m = apart_m;
    place_ = i;
  }
  steps_off_path_ += best_m > kOffPath_m;
}

/// Returns the steering angle of pure pursuit from point `place` of the path (Coulter, Implementation of the pure
/// pursuit path tracking algorithm, 1992).
float LaneKeepingAgent::steer_to(const Motion& now, size_t place) const {
  const Vec2 target = points()[ahead(place, std::clamp(2 + 0.6f * now.speed_mps, 2.0f, 10.0f))].position_m.xy();
  const SinCos heading = sincos_of(now.heading_rad);
  const Vec2 apart = target - Vec2{now.x_m, now.y_m};
  const float left_m = cross({heading.cos, heading.sin}, apart);
  return std::atan(2 * left_m * agent_.wheelbase_m() / std::max(dot(apart, apart), 1.0f));
}

int32_t LaneKeepingAgent::pursuing_action(const Motion& now, size_t place, float wanted_mps) const {
  const int32_t straight = agent_.speed_action(now, wanted_mps);
  const float wanted_rad = steer_to(now, place);
  int32_t best = straight;
  float minimum = INFINITY;
  for (const int32_t side : {-1, 0, 1}) {
    // A lateral acceleration that changes its sign is 0 for one step, so an action may take effect only in the second
    // step.
    const Motion next = agent_.after(agent_.after(now, straight + side), straight + side);
    const float off = std::fabs(next.steer_rad - wanted_rad);
    if (off >= minimum) continue;
    minimum = off;
    best = straight + side;
  }
  return best;
}

int32_t LaneKeepingAgent::action_of(Driving how, const Motion& now, size_t place) const {
  if (how == Driving::brakes_straight) return agent_.speed_action(now, 0);
  return pursuing_action(now, place, how == Driving::pursues ? points()[place].speed_mps : 0);
}

/// Whether the agent stays on the road, with a margin, if it takes this action and then drives in the way `how`. The
/// prediction ends at the horizon, when the agent has braked to rest, or when it has left through an exit.
bool LaneKeepingAgent::stays_on_road(Motion now, int32_t action, Driving how) const {
  constexpr float kHorizon_m = 20;
  const float margin_m = how == Driving::pursues ? 0.1f : 0.02f;
  size_t place = place_;
  for (float ahead_m = 0; ahead_m < kHorizon_m; ahead_m += driven_m(now.speed_mps, agent_.dt_s())) {
    const Motion before = now;
    now = agent_.after(now, action);
    place = nearest_point(points(), place, {now.x_m, now.y_m});
    const float z_m = points()[place].position_m.z;
    if (agent_.leaves_road(now, z_m, margin_m)) return false;
    if (agent_.crosses_exit(before, now, z_m)) return true;
    if (how != Driving::pursues && now.speed_mps < kStanding_mps) return true;
    action = action_of(how, now, place);
  }
  return true;
}

/// Whether the agent can stop without leaving the road after this action.
bool LaneKeepingAgent::can_stop_after(const Motion& now, int32_t action) const {
  return stays_on_road(now, action, Driving::brakes) || stays_on_road(now, action, Driving::brakes_straight);
}

/// Returns an action that brakes and, if possible, keeps the agent on the road.
int32_t LaneKeepingAgent::braking_action(const Motion& now) const {
  const int32_t action = action_of(Driving::brakes, now, place_);
  if (stays_on_road(now, action, Driving::brakes)) return action;
  const int32_t straight = action_of(Driving::brakes_straight, now, place_);
  if (stays_on_road(now, straight, Driving::brakes_straight)) return straight;
  // Jerks are too coarse for a speed of exactly 0: a stopped agent creeps by millimetres per second, so it must
  // sometimes reverse.
  constexpr float kBack_mps = 0.5f;
  return std::fabs(now.speed_mps) < kStanding_mps ? agent_.speed_action(now, std::copysign(kBack_mps, -now.speed_mps))
                                                  : action;
}

/// Returns the maximum speed from which the agent can stop before the next closed stop line, see to_closed_line().
float LaneKeepingAgent::speed_before_light(const Motion& now) {
  constexpr float kMargin_m = 2.0f;
  const float gap_m = to_closed_line(now) - kMargin_m;
  stops_ += gap_m < 1 && now.speed_mps < kStanding_mps;
  return std::sqrt(2 * 1.5f * std::max(gap_m, 0.0f));
}

/// Returns the distance along the route from the front bumper to the next closed stop line: one whose light is red, or
/// yellow with enough distance to stop. Returns 1000 if there is none ahead. For a line near the bumper, the exact
/// position of the agent is used: the path's points are too coarse to tell whether the bumper is past the line.
float LaneKeepingAgent::to_closed_line(const Motion& now) const {
  constexpr float kLookahead_m = 45, kAt_m = 1;
  const Vec2 here = points()[place_].position_m.xy();
  std::vector<size_t> near;
  for (size_t light = 0; light < world_.map.stop_lines.size(); ++light) {
    const LightState state = world_.lights[light];
    const bool closes = state == LightState::red || state == LightState::yellow;
    if (closes && length(world_.map.stop_lines[light].middle_m.xy() - here) < kLookahead_m + 10) near.push_back(light);
  }
  if (near.empty()) return 1000;
  const SinCos ahead_of_it = sincos_of(now.heading_rad);
  const Vec2 bumper = Vec2{now.x_m, now.y_m} + Vec2{ahead_of_it.cos, ahead_of_it.sin} * agent_.to_bumper_m();
  const size_t first = ahead(place_, agent_.to_bumper_m() - kAt_m), last = ahead(place_, kLookahead_m);
  for (size_t i = first; i < last; ++i) {
    const PathPoint &a = points()[i], &b = points()[i + 1];
    const float to_line_m = std::max(LanePath::kSpacing_m * static_cast<float>(i - first) - kAt_m, 0.0f);
    const SinCos heading = sincos_of(b.heading_rad);
    for (const size_t light : near) {
      const StopLine& line = world_.map.stop_lines[light];
      const bool can_stop = to_line_m > 0.5f * square(now.speed_mps) / 3.0f;
      if (world_.lights[light] == LightState::yellow && !can_stop) continue;
      const Vec2 from = a.position_m.xy() - line.middle_m.xy(), to = b.position_m.xy() - line.middle_m.xy();
      const bool is_past = to_line_m < kAt_m && dot(bumper - line.middle_m.xy(), line.direction) >= 0;
      if (!is_past && dot(from, line.direction) < 0 && dot(to, line.direction) >= 0 && is_within_ends(line, to) &&
          holds(line, {heading.cos, heading.sin}, b.position_m.z)) {
        return to_line_m;
      }
    }
  }
  return 1000;
}

/// Returns the maximum speed from which the agent can stop before it touches another agent on its path. If the other
/// agent has priority, its predicted positions in the next seconds are avoided too.
float LaneKeepingAgent::speed_behind_others() const {
  constexpr float kLookahead_m = 40, kMargin_m = 0.4f, kGap_m = 2;
  // Other agents may halt within one step; the agent then brakes hard.
  constexpr float kBraking_mps2 = 1.5f, kHardBraking_mps2 = 3;
  constexpr float kForesight_s = 4, kStep_s = 0.5f;
  const Motion now = agent_.now();
  const bool changes_lane = is_changing_lane();
  float max_mps = INFINITY;
  std::vector<AgentBox> way;
  for (int other = 0; other < world_.num_agents; ++other) {
    const int slot = world_.first_slot + other;
    const AgentBox box = box_of(world_.agents, slot);
    const Vec2 apart = box.center_m.xy() - points()[place_].position_m.xy();
    if (other == self_ || !box.drawn || dot(apart, apart) > square(kLookahead_m)) continue;
    for (size_t i = place_ + way.size(); i < ahead(place_, kLookahead_m); ++i) {
      way.push_back(agent_.box(points()[i].position_m, points()[i].heading_rad, kMargin_m));
    }
    const Vec2 velocity = Vec2{box.cos_heading, box.sin_heading} * world_.agents.speed_mps[slot];
    const bool crosses = has_right_of_way(other), merges = changes_lane && !follows(box);
    for (float soon_s = 0; soon_s <= (crosses || merges ? kForesight_s : 0); soon_s += kStep_s) {
      AgentBox there = box;
      there.center_m = box.center_m + Vec3{velocity.x, velocity.y, 0} * soon_s;
      if (soon_s > 0 && !crosses) {
        const size_t then = ahead(0, std::max(now.speed_mps, 2.0f) * soon_s);
        if (then >= way.size() || first_touching({way[then]}, there) == 1) continue;
      }
      const size_t first = first_touching(way, there);
      if (first == way.size()) continue;
      const float gap_m = std::max(LanePath::kSpacing_m * static_cast<float>(first) - kGap_m, 0.0f);
      const float along_mps = dot(velocity, {way[first].cos_heading, way[first].sin_heading});
      const float then_mps = soon_s > 0 ? 0 : std::max(along_mps, 0.0f);
      max_mps = std::min(
          {max_mps, std::sqrt(square(then_mps) + 2 * kBraking_mps2 * gap_m), std::sqrt(2 * kHardBraking_mps2 * gap_m)});
    }
  }
  return max_mps;
}

/// Whether the other agent has priority: agents with lower indices have priority, unless both have about the same
/// heading.
bool LaneKeepingAgent::has_right_of_way(int other) const {
  const float turned = wrap_angle(world_.agents.heading_rad[world_.first_slot + other] - agent_.now().heading_rad);
  return other < self_ && std::fabs(turned) > 0.5f;
}

/// Whether the agent's path changes lanes here or within kSoon_m.
bool LaneKeepingAgent::is_changing_lane() const {
  constexpr float kSoon_m = 20, kAside_m = 0.3f;
  for (size_t i = place_; i <= ahead(place_, kSoon_m); ++i) {
    if (std::fabs(points()[i].change.aside_now_m()) > kAside_m) return true;
  }
  return false;
}

/// Whether the other agent is behind this agent on the same lane.
bool LaneKeepingAgent::follows(const AgentBox& other) const {
  const Motion now = agent_.now();
  const SinCos heading = sincos_of(now.heading_rad);
  const Vec2 forward{heading.cos, heading.sin}, apart = other.center_m.xy() - Vec2{now.x_m, now.y_m};
  return dot(forward, apart) < 0 && std::fabs(cross(forward, apart)) < 1.5f;
}

LaneKeepingController::LaneKeepingController(const Simulator& simulator) {
  setup_ =
      std::make_unique<SimulatorSetup>(simulator.config(), simulator.maps(), simulator.handles(), simulator.worlds());
  for (const auto& map : simulator.maps()) graphs_.push_back(std::make_unique<LaneGraph>(*map->road));
  episode_.assign(simulator.worlds().size(), -1);
  views_.resize(simulator.worlds().size());
  agents_.resize(simulator.num_slots());
}

LaneKeepingController::~LaneKeepingController() = default;

void LaneKeepingController::act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
                                Stream) {
  check_controller_arrays(name(), input, Device{}, mask, commands_out);
  for (size_t w = 0; w < episode_.size(); ++w) {
    if (input.episode_step[w] == 0) begin_episode(input, w);
    PICTURA_CHECK(episode_[w] == input.episode_index[w],
                  "controller lane: world {}: expected to act from the first step of episode {} on, got step {}", w,
                  input.episode_index[w], input.episode_step[w]);
    if (views_[w]->map.is_open) begin_lives(w);
  }
  // The loop can run in parallel, because agents only read the state and write only their own commands.
  parallel_for(setup_->config.num_threads, static_cast<int64_t>(episode_.size()), [&](int64_t world) {
    const auto w = static_cast<size_t>(world);
    const auto end = static_cast<size_t>(setup_->slot_begin[w + 1]);
    for (auto slot = static_cast<size_t>(setup_->slot_begin[w]); slot < end; ++slot) {
      if (!mask.empty() && !mask[slot]) continue;
      commands_out[slot] = {};
      const bool is_active = input.state.status[slot] == AgentStatus::active;
      if (agents_[slot] && is_active) commands_out[slot].action = agents_[slot]->act();
    }
  });
}

void LaneKeepingController::begin_episode(const SimulatorArrays& input, size_t world) {
  // The view points to the simulator's agents, boxes and lights. This controller only reads them.
  const auto map = static_cast<size_t>(setup_->worlds[world].map);
  WorldView& view =
      views_[world].emplace(setup_->view(static_cast<int>(world), setup_->map_views[map], setup_->options));
  view.seed = input.seed[world];
  view.episode = static_cast<uint32_t>(input.episode_index[world]);
  view.agents = input.state;
  view.boxes = view.boxes_before = const_cast<AgentBox*>(input.scene.agents.data()) + view.first_box;
  view.lights = const_cast<LightState*>(input.scene.light_states.data()) + input.scene.light_begin[world];
  for (int agent = 0; agent < view.num_agents; ++agent) {
    agents_[view.first_slot + agent] = nullptr;
  }
  begin_lives(world);
  episode_[world] = input.episode_index[world];
}

/// Creates the LaneKeepingAgent of each agent whose life has begun since the last call.
void LaneKeepingController::begin_lives(size_t world) {
  const WorldView& view = *views_[world];
  const LaneGraph& graph = *graphs_[setup_->worlds[world].map];
  for (int agent = 0; agent < view.num_agents; ++agent) {
    const auto slot = static_cast<size_t>(view.first_slot + agent);
    const bool is_known = agents_[slot] && agents_[slot]->life() == view.agents.life[slot];
    if (is_known || !is_active(view, agent) || walks(view, agent)) continue;
    agents_[slot] = agents_[slot]
                        ? std::make_unique<LaneKeepingAgent>(view, agent, graph, agents_[slot]->search_nodes())
                        : std::make_unique<LaneKeepingAgent>(view, agent, graph);
  }
}

}  // namespace pictura
