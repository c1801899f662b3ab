#include "pictura/simulator/controllers/idm.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/goal.h"
#include "pictura/simulator/rules/record.h"
#include "pictura/simulator/rules/world_view.h"

namespace pictura {
namespace {

FollowedPath path_of(const MapRecord& record, size_t agent) {
  FollowedPath path;
  for (int32_t step = 0; step < record.num_steps; ++step) {
    const RecordedState& state = record.state(agent, step);
    if (!state.is_present) continue;
    path.add(state.position_m, state.heading_rad);
  }
  return path;
}

/// Returns the successor of a lane that turns least; -1 if there is none.
int32_t straightest_after(const MapView& map, int32_t lane_index) {
  const MapLane& lane = map.lanes[lane_index];
  const int32_t count = lane.num_successors > 0 ? lane.num_successors : lane.num_all_successors;
  int32_t best = -1;
  float least_rad = INFINITY;
  for (int32_t i = 0; i < count; ++i) {
    const int32_t next = map.successors[lane.first_successor + i];
    if (map.lanes[next].num_segments == 0) continue;
    const float end_m = map.lanes[next].length_m;
    const float turn_rad =
        std::abs(wrap_angle(pose_on_lane(map, next, end_m).heading_rad - pose_on_lane(map, next, 0).heading_rad));
    if (turn_rad >= least_rad) continue;
    least_rad = turn_rad;
    best = next;
  }
  return best;
}

/// Returns the point of the lane's centre line nearest to p, and its distance from p.
RoutePoint nearest_on_lane(const MapView& map, int32_t lane_index, Vec2 p, float* apart_m_out) {
  const MapLane& lane = map.lanes[lane_index];
  RoutePoint nearest{lane_index, 0};
  *apart_m_out = INFINITY;
  for (int32_t i = 0; i < lane.num_segments; ++i) {
    const LaneSegment& segment = map.segments[lane.first_segment + i];
    const Foot foot = foot_on(segment, p);
    if (foot.distance_m >= *apart_m_out) continue;
    *apart_m_out = foot.distance_m;
    nearest.s_m = segment.s_m + foot.along_m;
  }
  return nearest;
}

/// Returns the lane of the point or, if it has no successors, the nearest lane beside it that has successors.
int32_t lane_to_follow(const MapView& map, RoutePoint at) {
  return map.lanes[at.lane].num_all_successors > 0 ? at.lane : through_lane(map, at).lane;
}

/// Starts a path from p along the lane to follow, see lane_to_follow(). Moves the point *at_inout to the point of that
/// lane nearest to p, and returns the distance along the lane over which the path reaches its centre line. If the path
/// leaves the point's own lane, it does so before the end of that lane. If there is no room for this, returns nullopt,
/// and moves the point along its own lane until the front bumper is just before the lane's end.
std::optional<float> merge(const MapView& map, Vec2 p, float front_m, RoutePoint* at_inout) {
  constexpr float kMinMerge_m = 6, kMergePerMetre = 4;  // per metre of distance from the centre line
  constexpr float kBeforeEnd_m = 0.5f;
  float aside_m = 0;
  RoutePoint& at = *at_inout;
  at = nearest_on_lane(map, at.lane, p, &aside_m);
  const int32_t followed = lane_to_follow(map, at);
  if (followed == at.lane) return std::max(kMinMerge_m, kMergePerMetre * aside_m);
  const float left_m = map.lanes[at.lane].length_m - at.s_m - front_m - kBeforeEnd_m;
  if (left_m < kMinMerge_m) {
    at.s_m += std::max(left_m, 0.0f);
    return std::nullopt;
  }
  at = nearest_on_lane(map, followed, p, &aside_m);
  return std::max(kMinMerge_m, std::min(kMergePerMetre * aside_m, left_m));
}

}  // namespace

float idm_acceleration(const IdmParameters& parameters, float speed_mps, float gap_m, float front_mps) {
  const float free = std::pow(speed_mps / parameters.wanted_mps, parameters.exponent);
  float interaction = 0;
  if (std::isfinite(gap_m)) {
    constexpr float kLeastGap_m = 0.1f;
    const float closing =
        speed_mps * (speed_mps - front_mps) / (2 * std::sqrt(parameters.accel_mps2 * parameters.brake_mps2));
    const float wanted_m = parameters.min_gap_m + std::max(0.0f, speed_mps * parameters.headway_s + closing);
    interaction = square(wanted_m / std::max(gap_m, kLeastGap_m));
  }
  return parameters.accel_mps2 * (1 - free - interaction);
}

void FollowedPath::add(Vec3 point_m, float its_heading_rad) {
  const float piece_m = points_m.empty() ? 0 : length((point_m - points_m.back()).xy());
  if (!points_m.empty() && piece_m < kMinPiece_m) return;
  s_m.push_back(s_m.empty() ? 0 : s_m.back() + piece_m);
  points_m.push_back(point_m);
  heading_rad.push_back(its_heading_rad);
}

float FollowedPath::nearest_m(Vec2 p, float from_s_m) const {
  float best_m = from_s_m, minimum = INFINITY;
  for (size_t i = 0; i + 1 < points_m.size(); ++i) {
    if (s_m[i + 1] + kMinPiece_m < from_s_m) continue;
    const Vec2 a = points_m[i].xy(), way = (points_m[i + 1] - points_m[i]).xy();
    const float t = std::clamp(dot(p - a, way) / dot(way, way), 0.0f, 1.0f);
    const float apart_m = length(p - (a + way * t));
    if (apart_m >= minimum) continue;
    minimum = apart_m;
    best_m = s_m[i] + t * (s_m[i + 1] - s_m[i]);
  }
  return best_m;
}

FollowedPath::Pose FollowedPath::at(float wanted_s_m) const {
  const float s = std::clamp(wanted_s_m, 0.0f, length_m());
  const auto next = std::upper_bound(s_m.begin(), s_m.end(), s);
  if (next == s_m.end()) return {points_m.back(), heading_rad.back()};
  const auto i = static_cast<size_t>(next - s_m.begin()) - 1;
  const float t = (s - s_m[i]) / (s_m[i + 1] - s_m[i]);
  return {points_m[i] + (points_m[i + 1] - points_m[i]) * t,
          wrap_angle(heading_rad[i] + t * wrap_angle(heading_rad[i + 1] - heading_rad[i]))};
}

FollowedPath path_along_lanes(const MapView& map, int32_t lane, Vec3 position_m, float heading_rad, float front_m) {
  constexpr float kAhead_m = 200, kSpacing_m = 1;
  FollowedPath path;
  path.add(position_m, heading_rad);
  if (lane < 0) return path;
  RoutePoint at{lane, 0};
  const auto end_at = [&path, &map](RoutePoint end) {
    const LanePose pose = pose_on_lane(map, end.lane, end.s_m);
    path.add(pose.position_m, pose.heading_rad);
    return path;
  };
  std::optional<float> step_m = merge(map, position_m.xy(), front_m, &at);
  if (!step_m) return end_at(at);
  for (float ahead_m = 0; ahead_m < kAhead_m; step_m = kSpacing_m) {
    ahead_m += *step_m;
    for (float rest_m = *step_m; rest_m > 0;) {
      const float length_m = map.lanes[at.lane].length_m;
      const float taken_m = std::min(rest_m, std::max(length_m - at.s_m, 0.0f));
      at.s_m += taken_m;
      rest_m -= taken_m;
      if (rest_m <= 0) break;
      const int32_t next = straightest_after(map, at.lane);
      if (next < 0) return end_at({at.lane, length_m});
      at = {next, 0};
      if (lane_to_follow(map, at) == next) continue;
      step_m = merge(map, pose_on_lane(map, next, 0).position_m.xy(), front_m, &at);
      if (!step_m) return end_at(at);
      rest_m = *step_m;
      ahead_m += rest_m;
    }
    const LanePose pose = pose_on_lane(map, at.lane, at.s_m);
    path.add(pose.position_m, pose.heading_rad);
  }
  path.ends = false;
  return path;
}

IdmController::IdmController(const Simulator& simulator, IdmPaths paths, const IdmParameters& parameters)
    : wanted_paths_(paths), parameters_(parameters), dt_s_(simulator.config().dt_s), maps_(simulator.maps()) {
  for (const WorldSpec& world : simulator.worlds()) {
    const MapRules& rules = maps_[world.map]->rules;
    views_.push_back(rules.view());
    for (size_t agent = 0; agent < static_cast<size_t>(world.num_agents); ++agent) {
      FollowedPath path;
      if (agent < rules.record.agents.size()) {
        const bool walks = rules.record.agents[agent].agent_class == static_cast<int32_t>(AgentClass::pedestrian);
        if (walks || paths == IdmPaths::logged) path = path_of(rules.record, agent);
      }
      on_lanes_.push_back(path.points_m.empty());
      paths_.push_back(std::move(path));
    }
  }
  progress_m_.assign(paths_.size(), 0);
  life_.assign(paths_.size(), 0);
}

void IdmController::act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) {
  check_controller_arrays(name(), input, Device{}, mask, commands_out);
  for (size_t slot = 0; slot < commands_out.size(); ++slot) {
    if (!mask.empty() && !mask[slot]) continue;
    commands_out[slot] = {};
    if (takes_actions(input.state.status[slot])) commands_out[slot] = command_of(input, slot);
  }
}

/// Returns the agent's arc length on its path. A path along lanes is rebuilt if the agent was moved away from it or its
/// end is near.
float IdmController::place_on_path(const SimulatorArrays& input, size_t slot) {
  constexpr float kOffPath_m = 1, kLeast_m = 60;
  const auto world = static_cast<size_t>(input.slots.world_of_slot[slot]);
  FollowedPath& path = paths_[slot];
  const Vec3 here{input.state.x_m[slot], input.state.y_m[slot], input.state.z_m[slot]};
  const bool begins = input.episode_step[world] == 0 || input.state.life[slot] != life_[slot];
  life_[slot] = input.state.life[slot];
  // Progress along the path is monotonic except at an episode start.
  float s_m = path.points_m.empty() ? 0.0f : path.nearest_m(here.xy(), begins ? 0.0f : progress_m_[slot]);
  const auto serves = [&] {
    return length((path.at(s_m).position_m - here).xy()) <= kOffPath_m &&
           (path.ends || path.length_m() - s_m >= kLeast_m);
  };
  if (on_lanes_[slot] && (begins || path.points_m.empty() || !serves())) {
    const bool walks = input.state.agent_class[slot] == AgentClass::pedestrian;
    const float front_m = reference_to_bumper(input.state.agent_class[slot], input.state.length_m[slot]);
    path = path_along_lanes(views_[world], walks ? -1 : input.state.lane[slot], here, input.state.heading_rad[slot],
                            front_m);
    s_m = 0;
  }
  progress_m_[slot] = s_m;
  return s_m;
}

IdmController::Front IdmController::box_ahead(const SimulatorArrays& input, size_t slot, float s_m) const {
  const FollowedPath& path = paths_[slot];
  const auto agent = static_cast<int>(slot);
  const auto world = static_cast<size_t>(input.slots.world_of_slot[slot]);
  const int first_box = input.scene.world_begin[world], end_box = input.scene.world_begin[world + 1];
  const int own_box = first_box + input.slots.agent_of_slot[slot];
  for (float ahead_m = 1; ahead_m <= parameters_.look_ahead_m; ++ahead_m) {
    if (s_m + ahead_m > path.length_m()) break;
    const FollowedPath::Pose pose = path.at(s_m + ahead_m);
    const SinCos heading = sincos_of(pose.heading_rad);
    const AgentBox swept = box_at(input.state, agent, pose.position_m, heading);
    for (int i = first_box; i < end_box; ++i) {
      const AgentBox& other = input.scene.agents[i];
      const Vec2 apart = (other.center_m - swept.center_m).xy();
      if (i == own_box || !other.drawn || dot(apart, apart) > square(radius(swept) + radius(other))) continue;
      if (!same_level(swept, other) || !overlap(footprint(swept), footprint(other))) continue;
      Front front{ahead_m - 1, 0};
      const int other_agent = i - first_box, first_slot = input.slots.slot_begin[world];
      if (other_agent < input.slots.slot_begin[world + 1] - first_slot) {
        const int other_slot = first_slot + other_agent;
        const Vec2 its_way{input.state.cos_heading[other_slot], input.state.sin_heading[other_slot]};
        front.speed_mps = std::max(0.0f, input.state.speed_mps[other_slot] * dot(its_way, {heading.cos, heading.sin}));
      } else if (has_replayed_tracks(views_[world])) {
        const int replayed = other_agent - (input.slots.slot_begin[world + 1] - first_slot);
        const float its_mps = replayed_state(views_[world], replayed, input.episode_step[world]).speed_mps;
        const Vec2 its_way{other.cos_heading, other.sin_heading};
        front.speed_mps = std::max(0.0f, its_mps * dot(its_way, {heading.cos, heading.sin}));
      }
      return front;
    }
  }
  return {};
}

/// Returns the distance along the path from the front bumper to the first stop line that stops the agent; infinite if
/// there is none.
float IdmController::closed_line_ahead_m(const SimulatorArrays& input, size_t slot, float s_m) const {
  constexpr float kLookahead_m = 45;
  const FollowedPath& path = paths_[slot];
  const auto world = static_cast<size_t>(input.slots.world_of_slot[slot]);
  const Span<const StopLine> lines = views_[world].stop_lines;
  const Vec3 here = path.at(s_m).position_m;
  const float brakes_in_m = square(input.state.speed_mps[slot]) / (2 * parameters_.brake_mps2);
  float nearest_m = INFINITY;
  for (size_t i = 0; i < lines.size(); ++i) {
    const StopLine& line = lines[i];
    const LightState light = input.scene.light_states[static_cast<size_t>(input.scene.light_begin[world]) + i];
    const bool is_red = light == LightState::red;
    if (!is_red && light != LightState::yellow) continue;
    if (length((line.middle_m - here).xy()) > kLookahead_m + input.state.length_m[slot]) continue;
    Vec2 before{};
    for (float ahead_m = 0; ahead_m <= std::min(kLookahead_m, path.length_m() - s_m) && ahead_m <= nearest_m;
         ++ahead_m) {
      const FollowedPath::Pose pose = path.at(s_m + ahead_m);
      const AgentBox box = box_at(input.state, static_cast<int>(slot), pose.position_m, sincos_of(pose.heading_rad));
      const Vec2 way{box.cos_heading, box.sin_heading};
      const Vec2 bumper = box.center_m.xy() + way * (0.5f * box.length_m) - line.middle_m.xy();
      const bool crosses = ahead_m > 0 && dot(before, line.direction) < 0 && dot(bumper, line.direction) >= 0 &&
                           is_within_ends(line, bumper) && holds(line, way, pose.position_m.z);
      before = bumper;
      if (!crosses) continue;
      if (is_red || ahead_m - 1 >= brakes_in_m) nearest_m = std::min(nearest_m, ahead_m - 1);
      break;
    }
  }
  return nearest_m;
}

Command IdmController::command_of(const SimulatorArrays& input, size_t slot) {
  const float s_m = place_on_path(input, slot);
  const FollowedPath& path = paths_[slot];
  const float speed_mps = std::max(0.0f, input.state.speed_mps[slot]);
  Front front = box_ahead(input, slot, s_m);
  IdmParameters parameters = parameters_;
  if (on_lanes_[slot]) {
    const auto world = static_cast<size_t>(input.slots.world_of_slot[slot]);
    const int32_t lane = input.state.lane[slot];
    const bool walks = input.state.agent_class[slot] == AgentClass::pedestrian;
    if (!walks && lane >= 0) {
      parameters.wanted_mps = std::min(parameters.wanted_mps, views_[world].lanes[lane].speed_limit_mps);
    }
    const float line_m = closed_line_ahead_m(input, slot, s_m);
    if (line_m < front.gap_m) front = {line_m, 0};
  }
  float next_mps =
      std::max(0.0f, speed_mps + dt_s_ * idm_acceleration(parameters, speed_mps, front.gap_m, front.speed_mps));
  const float left_m = path.length_m() - s_m;
  next_mps = std::min(next_mps, left_m / dt_s_);
  const FollowedPath::Pose pose = path.at(s_m + next_mps * dt_s_);
  return {.kind = CommandKind::kinematic_state,
          .x_m = pose.position_m.x,
          .y_m = pose.position_m.y,
          .z_m = pose.position_m.z,
          .heading_rad = pose.heading_rad,
          .speed_mps = next_mps};
}

}  // namespace pictura
