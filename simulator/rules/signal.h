// Traffic lights, and running a red light.
#pragma once

#include "pictura/common/color.h"
#include "pictura/common/rng.h"
#include "pictura/simulator/rule_choices.h"
#include "pictura/simulator/rules/map_view.h"

namespace pictura {

/// Light cycle of a stop line in an episode. The phases of a junction take turns: one phase is green, then yellow, then
/// red, while the others are red.
struct LightPlan {
  int32_t green_steps = 0, yellow_steps = 0, red_steps = 0;
  int32_t offset_steps = 0;
  int32_t phase = 0, num_phases = 1;
  uint8_t is_off = 0;
  uint8_t padding[3] = {};
};

/// Draws a stop line's plan for an episode. By default (training), each junction has green U(1, 10) s, yellow U(1.5,
/// 2.25) s, red U(0.3, 10) s and a time offset. In a fifth of the episodes all lights are off; in the others, a fifth
/// of the lights are off. With LightCycles::independent, each light has its own cycle, and a light that is not off
/// stays green throughout the episode with probability 0.05. With `fixed` (evaluation), durations are 10, 3 and 2 s,
/// and only the offset is drawn. A line that belongs to no junction has its own cycle.
PICTURA_HD inline LightPlan draw_light_plan(const StopLine& line, int32_t light, LightCycles cycles, bool fixed,
                                            float dt_s, uint64_t seed, uint32_t world, uint32_t episode) {
  constexpr float kOffFraction = 0.2f, kAlwaysGreenFraction = 0.05f;
  constexpr uint32_t kEpisodeKey = 0, kJunctionKey = 1, kLightKey = 2, kLoneLightKey = 3;
  // In the random keys below, `agent` is the key's kind (episode, junction or light) and `step` is the index of the
  // junction or light.
  const bool is_independent = cycles == LightCycles::independent;
  const bool is_alone = is_independent || line.junction < 0;
  const uint32_t group = static_cast<uint32_t>(is_alone ? light : line.junction);
  RandomStream timing({.seed = seed,
                       .world = world,
                       .agent = is_alone ? kLoneLightKey : kJunctionKey,
                       .episode = episode,
                       .step = group,
                       .purpose = Purpose::lights});
  const float green_s = timing.uniform(1.0f, 10.0f);
  const float yellow_s = timing.uniform(1.5f, 2.25f);
  const float red_s = timing.uniform(0.3f, 10.0f);
  LightPlan plan;
  plan.green_steps = max_of(1, static_cast<int>((fixed ? 10.0f : green_s) / dt_s + 0.5f));
  plan.yellow_steps = max_of(1, static_cast<int>((fixed ? 3.0f : yellow_s) / dt_s + 0.5f));
  plan.red_steps = max_of(1, static_cast<int>((fixed ? 2.0f : red_s) / dt_s + 0.5f));
  plan.phase = is_independent ? 0 : line.phase;
  plan.num_phases = is_independent ? 1 : line.num_phases;
  plan.offset_steps = timing.below(plan.num_phases * (plan.green_steps + plan.yellow_steps + plan.red_steps));
  if (!fixed) {
    RandomStream whole_episode(
        {.seed = seed, .world = world, .agent = kEpisodeKey, .episode = episode, .purpose = Purpose::lights});
    RandomStream own({.seed = seed,
                      .world = world,
                      .agent = kLightKey,
                      .episode = episode,
                      .step = static_cast<uint32_t>(light),
                      .purpose = Purpose::lights});
    const bool is_off_alone = own.uniform() < kOffFraction;
    plan.is_off = whole_episode.uniform() < kOffFraction || is_off_alone;
    if (is_independent && own.uniform() < kAlwaysGreenFraction) {
      plan.green_steps = 1;
      plan.yellow_steps = plan.red_steps = plan.offset_steps = 0;
    }
  }
  return plan;
}

PICTURA_HD inline LightState light_state(const LightPlan& plan, int step) {
  if (plan.is_off) return LightState::off;
  const int slot_steps = plan.green_steps + plan.yellow_steps + plan.red_steps;
  const int t = (plan.offset_steps + step) % (plan.num_phases * slot_steps);
  if (t / slot_steps != plan.phase) return LightState::red;
  const int in_slot = t % slot_steps;
  if (in_slot < plan.green_steps) return LightState::green;
  return in_slot < plan.green_steps + plan.yellow_steps ? LightState::yellow : LightState::red;
}

/// Returns the state `step` steps after the episode's start, recorded or planned. The last recorded state persists.
PICTURA_HD inline LightState light_state(const MapView& map, int light, const LightPlan& plan, int step) {
  if (map.recorded_lights.empty()) return light_state(plan, step);
  return map.recorded_lights[static_cast<size_t>(light) * static_cast<size_t>(map.recorded_steps) +
                             static_cast<size_t>(min_of(step, map.recorded_steps - 1))];
}

/// A stop line controls traffic within 45 degrees of its direction. It is extended by a tolerance, and across adjacent
/// oncoming lanes, so that agents cannot avoid a red light there.
constexpr float kStopLineCosine = 0.70710678f, kStopLineSideTolerance_m = 0.5f;

/// Whether the line controls traffic with direction `forward` (a unit vector) at height z_m.
PICTURA_HD inline bool holds(const StopLine& line, Vec2 forward, float z_m) {
  return dot(forward, line.direction) >= kStopLineCosine && fabsf(line.middle_m.z - z_m) < kLevel_m;
}

/// Whether a point is between the line's ends plus the tolerance.
PICTURA_HD inline bool is_within_ends(const StopLine& line, Vec2 from_middle_m) {
  return fabsf(cross(line.direction, from_middle_m)) <= line.half_length_m + kStopLineSideTolerance_m;
}

/// Motion of an agent in a step.
struct Crossing {
  Vec2 bumper_before, bumper_after;  // middle of the front bumper
  Vec2 forward;                      // after the step
  float z_m = 0;
  int32_t lane_before = -1, lane_after = -1;
};

PICTURA_HD inline Span<const int32_t> successors_of(const MapView& map, int32_t lane) {
  const MapLane& from = map.lanes[lane];
  return map.successors.subspan(from.first_successor, from.num_all_successors);
}

/// Whether lane `to` follows `from`, directly or after one lane, which may be shorter than a step.
PICTURA_HD inline bool follows(const MapView& map, int32_t from, int32_t to) {
  const Span<const int32_t> next = successors_of(map, from);
  for (size_t i = 0; i < next.size(); ++i) {
    if (next[i] == to) return true;
    const Span<const int32_t> after = successors_of(map, next[i]);
    for (size_t j = 0; j < after.size(); ++j) {
      if (after[j] == to) return true;
    }
  }
  return false;
}

/// Whether the new lane is neither next nor previous on the agent's route.
PICTURA_HD inline bool is_lane_change(const MapView& map, int32_t before, int32_t after) {
  return before >= 0 && after >= 0 && before != after && !follows(map, before, after) && !follows(map, after, before);
}

/// Whether the step violates stop line `light`. `state` is the light's state during the step, which agents observed
/// before the step. With a red light, two events violate the line: the front bumper crosses it, or an agent past it
/// changes from a lane without a light to a lane of this light. The agent must be on the line's level, within 45
/// degrees of its direction, and within 10 m of its middle. An agent that is on the line when it turns red may clear
/// the junction and enter the next lane of its route.
PICTURA_HD inline bool violates(const MapView& map, int32_t light, const Crossing& crossing, LightState state) {
  if (state != LightState::red) return false;
  const StopLine& line = map.stop_lines[light];
  const Vec2 past = crossing.bumper_after - line.middle_m.xy();
  if (dot(past, past) > square(kStopLineReach_m) || !holds(line, crossing.forward, crossing.z_m)) return false;
  const float along_before = dot(crossing.bumper_before - line.middle_m.xy(), line.direction);
  const float along_after = dot(past, line.direction);
  if (along_after < 0.0f) return false;
  if (along_before < 0.0f) {
    const float fraction = along_before / (along_before - along_after);
    const Vec2 at = crossing.bumper_before + (crossing.bumper_after - crossing.bumper_before) * fraction;
    const float side_m = cross(line.direction, at - line.middle_m.xy());  // positive to the left
    const float beyond_m = side_m > 0.0f ? line.beyond_left_m : line.beyond_right_m;
    if (fabsf(side_m) <= line.half_length_m + max_of(kStopLineSideTolerance_m, beyond_m)) return true;
  }
  return is_lane_change(map, crossing.lane_before, crossing.lane_after) && map.lanes[crossing.lane_before].light < 0 &&
         map.lanes[crossing.lane_after].light == light;
}

}  // namespace pictura
