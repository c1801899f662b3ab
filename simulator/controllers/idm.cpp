#include "pictura/simulator/controllers/idm.h"

#include <algorithm>
#include <cmath>

#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/world_view.h"

namespace pictura {
namespace {

RecordedPath path_of(const MapRecord& record, size_t agent) {
  RecordedPath path;
  const auto num_steps = static_cast<size_t>(record.num_steps);
  for (size_t step = 0; step < num_steps; ++step) {
    const RecordedState& state = record.states[agent * num_steps + step];
    if (!state.is_there) continue;
    const float piece_m = path.points_m.empty() ? 0 : length((state.position_m - path.points_m.back()).xy());
    if (!path.points_m.empty() && piece_m < RecordedPath::kMinPiece_m) continue;
    path.s_m.push_back(path.s_m.empty() ? 0 : path.s_m.back() + piece_m);
    path.points_m.push_back(state.position_m);
    path.heading_rad.push_back(state.heading_rad);
  }
  return path;
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

float RecordedPath::nearest_m(Vec2 p, float from_s_m) const {
  float best_m = from_s_m, least = INFINITY;
  for (size_t i = 0; i + 1 < points_m.size(); ++i) {
    if (s_m[i + 1] + kMinPiece_m < from_s_m) continue;
    const Vec2 a = points_m[i].xy(), way = (points_m[i + 1] - points_m[i]).xy();
    const float t = std::clamp(dot(p - a, way) / dot(way, way), 0.0f, 1.0f);
    const float apart_m = length(p - (a + way * t));
    if (apart_m >= least) continue;
    least = apart_m;
    best_m = s_m[i] + t * (s_m[i + 1] - s_m[i]);
  }
  return best_m;
}

RecordedPath::Pose RecordedPath::at(float wanted_s_m) const {
  const float s = std::clamp(wanted_s_m, 0.0f, length_m());
  const auto next = std::upper_bound(s_m.begin(), s_m.end(), s);
  if (next == s_m.end()) return {points_m.back(), heading_rad.back()};
  const auto i = static_cast<size_t>(next - s_m.begin()) - 1;
  const float t = (s - s_m[i]) / (s_m[i + 1] - s_m[i]);
  return {points_m[i] + (points_m[i + 1] - points_m[i]) * t,
          wrap_angle(heading_rad[i] + t * wrap_angle(heading_rad[i + 1] - heading_rad[i]))};
}

IdmController::IdmController(const Simulator& simulator, const IdmParameters& parameters)
    : parameters_(parameters), dt_s_(simulator.config().dt_s) {
  for (const WorldSpec& world : simulator.worlds()) {
    const MapRecord& record = simulator.maps()[static_cast<size_t>(world.map)]->rules.record;
    for (size_t agent = 0; agent < record.agents.size(); ++agent) paths_.push_back(path_of(record, agent));
  }
  progress_m_.assign(paths_.size(), 0);
}

void IdmController::act(const ControllerInput& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) {
  check_controller_arrays(name(), input, Device{}, mask, commands_out);
  for (size_t slot = 0; slot < commands_out.size(); ++slot) {
    if (!mask.empty() && !mask[slot]) continue;
    commands_out[slot] = {};
    const bool drives = takes_actions(static_cast<AgentStatus>(input.state.status[slot]));
    if (drives && !paths_[slot].points_m.empty()) commands_out[slot] = command_of(input, slot);
  }
}

Command IdmController::command_of(const ControllerInput& input, size_t slot) {
  const RecordedPath& path = paths_[slot];
  const auto agent = static_cast<int>(slot);
  const auto world = static_cast<size_t>(input.slots.world_of_slot[slot]);
  const Vec2 here{input.state.x_m[slot], input.state.y_m[slot]};
  const float speed_mps = std::max(0.0f, input.state.speed_mps[slot]);
  // Nobody goes back on the path but who begins anew.
  const float s_m = path.nearest_m(here, input.episode_step[world] == 0 ? 0.0f : progress_m_[slot]);
  progress_m_[slot] = s_m;

  float gap_m = INFINITY, front_mps = 0;
  const int first_box = input.scene.world_begin[world], end_box = input.scene.world_begin[world + 1];
  const int own_box = first_box + input.slots.agent_of_slot[slot];
  for (float ahead_m = 1; ahead_m <= parameters_.look_ahead_m && !std::isfinite(gap_m); ++ahead_m) {
    if (s_m + ahead_m > path.length_m()) break;
    const RecordedPath::Pose pose = path.at(s_m + ahead_m);
    const SinCos heading = sincos_of(pose.heading_rad);
    const AgentBox swept = box_at(input.state, agent, pose.position_m, heading);
    for (int i = first_box; i < end_box; ++i) {
      const AgentBox& other = input.scene.agents[static_cast<size_t>(i)];
      const Vec2 apart = (other.center_m - swept.center_m).xy();
      if (i == own_box || !other.drawn || dot(apart, apart) > square(radius(swept) + radius(other))) continue;
      if (!same_level(swept, other) || !overlap(footprint(swept), footprint(other))) continue;
      gap_m = ahead_m - 1;
      const int other_agent = i - first_box, first_slot = input.slots.slot_begin[world];
      if (other_agent < input.slots.slot_begin[world + 1] - first_slot) {
        const int other_slot = first_slot + other_agent;
        const Vec2 its_way{input.state.cos_heading[other_slot], input.state.sin_heading[other_slot]};
        front_mps = std::max(0.0f, input.state.speed_mps[other_slot] * dot(its_way, {heading.cos, heading.sin}));
      }
      break;
    }
  }
  float next_mps = std::max(0.0f, speed_mps + dt_s_ * idm_acceleration(parameters_, speed_mps, gap_m, front_mps));
  const float left_m = path.length_m() - s_m;
  next_mps = std::min(next_mps, left_m / dt_s_);
  const RecordedPath::Pose pose = path.at(s_m + next_mps * dt_s_);
  return {.kind = CommandKind::kinematic_state,
          .x_m = pose.position_m.x,
          .y_m = pose.position_m.y,
          .z_m = pose.position_m.z,
          .heading_rad = pose.heading_rad,
          .speed_mps = next_mps};
}

}  // namespace pictura
