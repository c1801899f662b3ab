#include "pictura/driving/replay_cases.h"

#include <cmath>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/support/messages.h"
#include "pictura/driving/replay_scenarios.h"
#include "pictura/evaluation/infractions.h"

namespace pictura {

namespace {

constexpr const char* kWhyOtherwise = "the policy's numbers differ in their last bits between batch sizes and devices";

// Scene, driver, step and ego of a case, with the ego's speed.
struct CasePlace {
  int32_t scene = 0, driver = 0, step = 0, ego = 0;
  float ego_speed_mps = 0;
};

CasePlace place_of(const RemovalCase& one) { return {one.scene, one.driver, one.step, one.ego, one.ego_speed_mps}; }
CasePlace place_of(const PedestrianPath& one) { return {one.scene, one.driver, one.step, one.ego, one.ego_speed_mps}; }

CasePlace place_of(const CornerState& one) { return {one.scene, one.driver, one.step, one.ego, one.speed_mps}; }

// Returns the requested case, or nothing if none was requested.
std::optional<size_t> asked_case(const CaseReplayOptions& options, size_t count) {
  if (count == 0) fail("--replay: the probe found no case");
  if (!options.number) return std::nullopt;
  check_case_number(options, static_cast<int64_t>(count));
  return static_cast<size_t>(*options.number);
}

// Returns the requested case, or the case with the largest change in the first policy's value.
size_t chosen_case(const CaseReplayOptions& options, const ProbeResults& results) {
  const size_t count = results.responses.size() / results.policies.size();
  if (const auto asked = asked_case(options, count)) return *asked;
  size_t largest = 0;
  const auto change = [&results](size_t i) { return std::abs(results.response(i, 0).value_change()); };
  for (size_t i = 1; i < count; ++i) {
    if (change(i) > change(largest)) largest = i;
  }
  return largest;
}

std::string about(const RemovalCase& one, RemovalControl control) {
  if (one.hidden < 0) return fmt::format("control: no agent is hidden from agent {}", one.ego);
  if (control == RemovalControl::permuted)
    return fmt::format("control: agent {} is hidden from agent {} instead of agent {}", one.hidden, one.ego, one.user);
  return fmt::format("agent {} is hidden from agent {}: a {}{} {:.1f} m away{}", one.user, one.ego,
                     one.user_halted ? "halted " : "", to_string(one.user_class), one.distance_m,
                     one.is_in_frame() ? fmt::format(", of which its cameras see {:.0f} %", 100 * one.visible_share)
                                       : ", which no camera sees");
}

std::string about(const PedestrianPoint& point, const PedestrianPath& path, PedestrianControl control) {
  if (control == PedestrianControl::unchanged)
    return fmt::format("control: no pedestrian is shown to agent {}", path.ego);
  return fmt::format("a pedestrian is shown to agent {}: {:.1f} m away, of which its cameras see {:.0f} %", path.ego,
                     point.distance_m, 100 * point.visible_share);
}

std::string about(const CornerState& one, int32_t removed, CornerControl control) {
  const std::string hidden =
      fmt::format("agent {} approaches hidden, towards agent {}, which is {:.1f} m before a blind corner", one.user,
                  one.ego, one.distance_m);
  if (control != CornerControl::permuted) return hidden;
  return fmt::format("{}; control: {} is removed instead", hidden,
                     removed < 0 ? "no agent" : fmt::format("agent {}", removed));
}

// Returns options of an evaluation that simulates a case's scene again, with the scene's driver.
EvaluateOptions driven_by(const ProbeOptions& probe, const CasePlace& place) {
  EvaluateOptions driven = probe.worlds;
  // place.driver is an index of probe.policies, except if a controller drives.
  if (driven.controller.empty()) driven.checkpoint = probe.policies[place.driver];
  return driven;
}
RecordedScenario scenario_of(const ProbeOptions& probe, const ProbeResults& results, const CasePlace& place) {
  return {.number = place.scene, .agents_per_world = results.agents_per_world, .world_of = probe.policies[0]};
}

// Reports on stderr if the ego's speed in the replay differs from that in the probe. Speeds in replays are rounded to 1
// cm/s.
void compare_speed(const std::string& path, const Replay& replay, int frame, int ego, float probed_mps) {
  const double speed_mps = 0.01 * replay.at(Track::speed_mps, frame, ego);
  if (std::abs(speed_mps - double{probed_mps}) < 0.0051) return;
  print_message("notice: {}: the ego drives at {:.2f} m/s, in the probe at {:.2f} m/s: {}\n", path, speed_mps,
                probed_mps, kWhyOtherwise);
}

// Writes the replay of a case at frame `frame`; `probed` describes the case.
void write(const CaseReplayOptions& options, const ProbeResults& results, size_t number, const CasePlace& place,
           int frame, ReplayCase probed, Replay replay) {
  probed.what = fmt::format("case {}: {}", number, probed.what);
  probed.frame = frame;
  probed.ego = place.ego;
  for (size_t policy = 0; policy < results.policies.size() && !results.responses.empty(); ++policy) {
    const PairedResponse& response = results.response(number, policy);
    probed.answers.push_back({.policy = results.policies[policy].responding_name(),
                              .value = double{response.value},
                              .value_without = double{response.value_without},
                              .brake = double{response.brake},
                              .brake_without = double{response.brake_without}});
  }
  replay.probed = std::move(probed);
  write_replay_with_message(options.path, replay);
  print_message("{}\n", replay.probed->what);
  compare_speed(options.path, replay, frame, place.ego, place.ego_speed_mps);
}

// Simulates the case's scene again, and writes the replay. describe(agents) returns the case, given the replay's agent
// of each slot in the case's frame.
template <typename Describe>
void write_scene(const CaseReplayOptions& options, const ProbeOptions& probe, const ProbeResults& results,
                 size_t number, CasePlace place, Describe&& describe) {
  RecordingOptions recording = options.recording;
  recording.followed = place.ego;
  ScenarioCounts counts;
  std::vector<int32_t> agent_of;
  Replay replay =
      record_scenario(driven_by(probe, place), scenario_of(probe, results, place), recording, &counts, &agent_of);
  if (place.step >= replay.num_frames) {
    fail("--replay: case {} is at step {} of scenario {}, which ended after {} steps when driven again: {}", number,
         place.step, place.scene, replay.num_frames - 1, kWhyOtherwise);
  }
  const int num_slots = static_cast<int>(agent_of.size()) / replay.num_frames;
  const Span<const int32_t> agents = Span<const int32_t>(agent_of).subspan(place.step * num_slots, num_slots);
  place.ego = agents[place.ego];
  write(options, results, number, place, place.step, describe(agents), std::move(replay));
}

}  // namespace

void check_case_number(const CaseReplayOptions& options, int64_t count) {
  if (options.number && *options.number >= count)
    fail_usage("--case: expected 0 to {}, got {}", count - 1, *options.number);
}

void write_case_replay(const CaseReplayOptions& options, const RemovalOptions& probe, const RemovalResults& results) {
  const size_t number = chosen_case(options, results);
  const RemovalCase& one = results.cases[number];
  write_scene(options, probe, results, number, place_of(one), [&](Span<const int32_t> agents) {
    RemovalCase shown = one;
    for (int32_t* agent : {&shown.ego, &shown.user, &shown.hidden}) {
      if (*agent >= 0) *agent = agents[*agent];
    }
    return ReplayCase{.what = about(shown, results.control), .removed = shown.hidden};
  });
}

void write_case_replay(const CaseReplayOptions& options, const PedestrianOptions& probe,
                       const PedestrianResults& results) {
  const size_t number = chosen_case(options, results);
  const PedestrianPoint& point = results.points[number];
  const PedestrianPath& path = results.paths[point.path];
  ReplayCase probed;
  if (results.control != PedestrianControl::unchanged) {
    probed.inserted = replay_box(point.pedestrian);
    const auto first = results.points.begin() + path.first_point;
    for (auto at = first; at != first + path.num_points; ++at) {
      const ReplayBox place = replay_box(at->pedestrian);
      probed.path_cm.push_back({place.x_cm, place.y_cm});
    }
  }
  write_scene(options, probe, results, number, place_of(path), [&](Span<const int32_t> agents) {
    PedestrianPath shown = path;
    shown.ego = agents[path.ego];
    probed.what = about(point, shown, results.control);
    return probed;
  });
}

void write_case_replay(const CaseReplayOptions& options, const CornerOptions& probe, const CornerResults& results) {
  const size_t pair = asked_case(options, results.pairs.size()).value_or(example_of(results));
  const CornerState& state = results.pairs[pair].hidden;
  const CasePlace place = place_of(state);
  const Replay replay = record_takeover(driven_by(probe, place), scenario_of(probe, results, place),
                                        {.policy = probe.policies[0],
                                         .untrained = results.control == CornerControl::untrained,
                                         .step = state.step,
                                         .agent = state.ego,
                                         .steps = kTakeoverSteps},
                                        options.recording);
  const std::string what = fmt::format("{}; from here on {} drives agent {}, and all other agents repeat their motion",
                                       about(state, results.scenes_of_pairs[pair].removed, results.control),
                                       results.policies[0].responding_name(), state.ego);
  write(options, results, pair, place, 0, {.what = what, .removed = state.user}, replay);
  const Takeover& probed = results.takeover(pair, true, CornerCase::hidden, 0);
  if (const int steps = replay.num_frames - 1; steps != probed.steps) {
    print_message("notice: {}: the ego drives for {} steps, in the probe for {}: {}\n", options.path, steps,
                  probed.steps, kWhyOtherwise);
  } else if (probed.ended_by == 0) {
    compare_speed(options.path, replay, steps, state.ego, probed.speed_mps[steps]);
  }
}

}  // namespace pictura
