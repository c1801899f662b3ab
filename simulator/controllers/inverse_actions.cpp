#include "pictura/simulator/controllers/inverse_actions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "pictura/common/error.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/rules/dynamics.h"

namespace pictura {
namespace {

/// A sequence of actions, stored as its last action and its predecessor in the beam of the previous step.
struct Sequence {
  Motion motion;
  double cost = 0;            // sum over all steps
  double predicted_cost = 0;  // cost plus the cost of returning to the record
  float error_m = 0;
  int32_t action = 0;
  int32_t before = -1;
};

/// Key of a motion. Sequences whose motions have the same key are similar; only the cheapest of them is kept, so that
/// the beam is diverse.
auto similarity_key(const Motion& motion) {
  const auto rounded = [](float value, float unit) { return static_cast<int32_t>(std::lround(value / unit)); };
  return std::tuple(rounded(motion.x_m, 0.02f), rounded(motion.y_m, 0.02f), rounded(motion.heading_rad, 0.01f),
                    rounded(motion.accel_long_mps2, 0.4f), rounded(motion.accel_lat_mps2, 0.4f));
}

double cost_of(const Motion& motion, const RecordedState& wanted, float* error_m_out) {
  constexpr double kSpeedWeight = 0.1, kHeadingWeight = 1, kAccelWeight = 0.002;
  const Vec2 apart = Vec2{motion.x_m, motion.y_m} - wanted.position_m.xy();
  *error_m_out = length(apart);
  const auto squared = [](float value) { return static_cast<double>(value) * static_cast<double>(value); };
  return squared(*error_m_out) + kSpeedWeight * squared(motion.speed_mps - wanted.speed_mps) +
         kHeadingWeight * squared(wrap_angle(motion.heading_rad - wanted.heading_rad)) +
         kAccelWeight * (squared(motion.accel_long_mps2) + squared(motion.accel_lat_mps2));
}

/// A recorded state, with velocity and acceleration estimated from the surrounding positions.
struct Target {
  RecordedState state;
  Vec2 velocity_mps, accel_mps2;
};

Target target_at(Span<const RecordedState> run, size_t i, float dt_s) {
  constexpr size_t kVelocitySteps = 3, kAccelSteps = 6, kMinAccelSteps = 3;  // before and after the step; many, because
                                                                             // records are noisy
  const auto place = [&](size_t step) { return run[step].position_m.xy(); };
  const size_t room = std::min(i, run.size() - 1 - i);
  Target target{.state = run[i]};
  if (const size_t steps = std::min(room, kVelocitySteps); steps > 0) {
    target.velocity_mps = (place(i + steps) - place(i - steps)) * (1 / (2 * static_cast<float>(steps) * dt_s));
  } else {
    const SinCos heading = sincos_of(run[i].heading_rad);
    target.velocity_mps = Vec2{heading.cos, heading.sin} * run[i].speed_mps;
  }
  if (const size_t steps = std::min(room, kAccelSteps); steps >= kMinAccelSteps) {
    const float time_s = static_cast<float>(steps) * dt_s;
    target.accel_mps2 = (place(i + steps) + place(i - steps) - place(i) * 2.0f) * (1 / square(time_s));
  }
  return target;
}

/// Returns the predicted cost of returning to the record from errors of position, velocity and acceleration. It is the
/// minimum sum of squared distances over future steps for a point whose jerk is controlled with bandwidth
/// kBandwidth_radps. Without this cost, the search is short-sighted and its paths oscillate about the record,
/// especially for long vehicles.
double cost_of_return(const Motion& motion, const Target& target, float dt_s) {
  constexpr double kBandwidth_radps = 2;
  constexpr double s1 = 1 / kBandwidth_radps, s2 = s1 * s1, s3 = s2 * s1, s4 = s3 * s1, s5 = s4 * s1;
  const SinCos heading = sincos_of(motion.heading_rad);
  const Vec2 along{heading.cos, heading.sin}, left{-heading.sin, heading.cos};
  const Vec2 apart = Vec2{motion.x_m, motion.y_m} - target.state.position_m.xy();
  const Vec2 drift = along * motion.speed_mps - target.velocity_mps;
  const Vec2 pull = along * motion.accel_long_mps2 + left * motion.accel_lat_mps2 - target.accel_mps2;
  const auto product = [](Vec2 a, Vec2 b) { return static_cast<double>(dot(a, b)); };
  return (2 * s1 * product(apart, apart) + 4 * s2 * product(apart, drift) + 2 * s3 * product(apart, pull) +
          3 * s3 * product(drift, drift) + 4 * s4 * product(drift, pull) + 2 * s5 * product(pull, pull)) /
         static_cast<double>(dt_s);
}

/// Extends the sequences of a beam by all actions and returns the beam of the next step.
std::vector<Sequence> next_beam(const std::vector<Sequence>& beam, const Target& target,
                                const DynamicsParameters& parameters, const ClassLimits& limits, float dt_s) {
  std::map<decltype(similarity_key(Motion{})), Sequence> best;
  for (size_t i = 0; i < beam.size(); ++i) {
    for (int32_t action = 0; action < kNumActions; ++action) {
      Sequence next;
      next.motion = move(beam[i].motion, controls_of_action(action), parameters, limits, dt_s);
      next.cost = beam[i].cost + cost_of(next.motion, target.state, &next.error_m);
      next.predicted_cost = next.cost + cost_of_return(next.motion, target, dt_s);
      next.action = action;
      next.before = static_cast<int32_t>(i);
      const auto [found, is_new] = best.emplace(similarity_key(next.motion), next);
      if (!is_new && next.predicted_cost < found->second.predicted_cost) found->second = next;
    }
  }
  std::vector<Sequence> all;
  for (const auto& [key, sequence] : best) all.push_back(sequence);
  std::stable_sort(all.begin(), all.end(),
                   [](const Sequence& a, const Sequence& b) { return a.predicted_cost < b.predicted_cost; });
  all.resize(std::min<size_t>(all.size(), kBeamWidth));
  return all;
}

/// Writes the actions for a run of consecutive recorded states to the elements of `out` from `first` on.
void follow_run(Span<const RecordedState> run, const RecordedAgent& agent, const DynamicsRules& rules, float dt_s,
                size_t first, InverseActions* out) {
  DynamicsParameters parameters;
  parameters.rules = rules;
  parameters.wheelbase_m = kWheelbasePerLength * agent.length_m;
  const ClassLimits limits = class_limits(static_cast<AgentClass>(agent.agent_class));
  Sequence start;
  start.motion.x_m = run[0].position_m.x;
  start.motion.y_m = run[0].position_m.y;
  start.motion.heading_rad = run[0].heading_rad;
  start.motion.speed_mps = run[0].speed_mps;
  std::vector<std::vector<Sequence>> beams{{start}};
  for (size_t i = 1; i < run.size(); ++i) {
    beams.push_back(next_beam(beams.back(), target_at(run, i, dt_s), parameters, limits, dt_s));
  }
  int32_t at = 0;
  for (size_t i = run.size(); i-- > 1;) {
    const Sequence& sequence = beams[i][at];
    out->actions[first + i - 1] = sequence.action;
    out->is_followed[first + i - 1] = 1;
    out->error_m[first + i - 1] = sequence.error_m;
    at = sequence.before;
  }
}

}  // namespace

InverseActions find_inverse_actions(const CompiledMap& scene, float dt_s, int num_threads, const DynamicsRules& rules) {
  const MapRecord& record = scene.rules.record;
  if (record.agents.empty()) fail_usage("inverse actions: expected a recorded scene, got map {}", scene.road->name);
  InverseActions out{.num_steps = record.num_steps};
  out.actions.assign(record.states.size(), kIdleAction);
  out.is_followed.assign(record.states.size(), 0);
  out.error_m.assign(record.states.size(), 0);
  const auto num_steps = static_cast<size_t>(record.num_steps);
  parallel_for(num_threads, static_cast<int64_t>(record.agents.size()), [&](int64_t agent) {
    const size_t first = static_cast<size_t>(agent) * num_steps;
    const Span<const RecordedState> states(record.states.data() + first, num_steps);
    for (size_t begin = 0; begin < num_steps;) {
      size_t end = begin;
      while (end < num_steps && states[end].is_present) ++end;
      if (end > begin + 1) {
        follow_run(states.subspan(begin, end - begin), record.agents[agent], rules, dt_s, first + begin, &out);
      }
      begin = end + 1;
    }
  });
  return out;
}

InverseTable::InverseTable(const Simulator& simulator) {
  for (const Conditioning which : {Conditioning::throttle, Conditioning::steer, Conditioning::acceleration}) {
    const ConditioningRange& range = simulator.config().conditioning[static_cast<size_t>(which)];
    if (range.low != 1 || range.high != 1) {
      fail_usage("controller inverse: conditioning {}: expected 1, as in the action search, got {} to {}",
                 kConditioningNames[static_cast<size_t>(which)], range.low, range.high);
    }
  }
  std::vector<ActionTable> of_map;
  for (const auto& map : simulator.maps()) {
    const SimulatorConfig& config = simulator.config();
    const InverseActions found = find_inverse_actions(*map, config.dt_s, config.num_threads, config.dynamics);
    of_map.push_back({static_cast<int64_t>(actions.size()), found.num_steps});
    actions.insert(actions.end(), found.actions.begin(), found.actions.end());
  }
  for (const WorldSpec& world : simulator.worlds()) worlds.push_back(of_map[world.map]);
}

void InverseController::act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
                            Stream) {
  check_controller_arrays(name(), input, Device{}, mask, commands_out);
  const TabledCommands rule{input.slots, input.episode_step, table_.worlds, table_.actions};
  for (size_t slot = 0; slot < commands_out.size(); ++slot) {
    if (mask.empty() || mask[slot]) commands_out[slot] = rule(slot);
  }
}

}  // namespace pictura
