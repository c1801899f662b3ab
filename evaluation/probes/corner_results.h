// Results of policies at blind corners.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pictura/evaluation/probes/corner_states.h"
#include "pictura/evaluation/probes/probe_results.h"
#include "pictura/evaluation/probes/takeover.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Situation at the corner.
enum class CornerCase : uint8_t {
  hidden,   // a hidden vehicle comes
  removed,  // control: the hidden state without the hidden vehicle
  empty,    // a similar state at a corner without a vehicle
};
constexpr std::array<const char*, 3> kCornerCaseNames{"hidden", "removed", "empty"};
constexpr size_t kCornerCases = kCornerCaseNames.size();
constexpr std::array<const char*, 2> kWallNames{"on", "off"};  // with and without walls, in the order of runs

/// Vehicle that CornerCase::removed lacks.
enum class CornerControl : uint8_t {
  none,       // no control: the hidden vehicle
  permuted,   // control: another vehicle near the ego, drawn at random; none if there is no other
  untrained,  // control: the hidden vehicle; the policies have fresh weights
};
constexpr std::array<const char*, 3> kCornerControlNames{"none", "permuted", "untrained"};

/// State at the takeover, for figures. Boxes: agents, then parked cars.
struct CornerScene {
  std::vector<AgentBox> boxes;
  std::vector<AgentStatus> status;  // [boxes]
  std::vector<Vec2> user_m;         // [kTakeoverSteps + 1] centre of the hidden vehicle
  int32_t removed = -1;             // agent that CornerCase::removed lacks; -1: none
};

struct CornerResults : ProbeResults {
  CornerSearch search;
  CornerControl control = CornerControl::none;
  int64_t pairs_asked = 0, hidden_found = 0, empty_found = 0;  // found: states before matching
  std::vector<CornerPair> pairs;             // ordered by scene, step, ego and user of the hidden state
  std::vector<CornerScene> scenes_of_pairs;  // [pairs] hidden state
  std::vector<Takeover> takeovers;           // [pairs, walls on and off, cases, policies]
  CompiledMaps maps;                         // for figures

  const Takeover& takeover(size_t pair, bool walls, CornerCase its_case, size_t policy) const {
    return takeovers[((pair * 2 + (walls ? 0 : 1)) * kCornerCases + static_cast<size_t>(its_case)) * policies.size() +
                     policy];
  }
};

/// Step of a run at which the ego first has a line of sight to the hidden vehicle, or to the removed vehicle's place.
/// An empty corner uses the step of the same policy's hidden run.
struct Reveal {
  int32_t step = 0;
  std::optional<float> distance_m;  // to the hidden vehicle, between box centres
  float corner_m = 0;               // remaining path to the corner's entry; negative beyond the entry
  float speed_mps = 0;
  float approach_mps = 0;                  // mean up to the reveal
  std::optional<float> deceleration_mps2;  // mean over the next 2 s, if the run lasts that long
};
/// Returns an empty value if the run ends before the reveal.
std::optional<Reveal> reveal_of(const CornerResults& results, size_t pair, bool walls, CornerCase its_case,
                                size_t policy);

/// Returns an example pair for figures: the pair with the largest speed difference between policies at the reveal, in
/// hidden runs with walls. Returns the first pair if no pair has a reveal for every policy.
size_t example_of(const CornerResults& results);

/// Means of Reveal's values. Members are named as in files.
struct CornerMeasures {
  Estimate distance_m, corner_m, speed_mps, approach_mps, deceleration_mps2;
};

/// Statistics of one policy's runs of a case, or of differences within each pair. A difference is the policy's run
/// minus less_policy's run of the same case, or minus the policy's own run of less_case. Estimates are over scenes.
struct CornerRow {
  bool walls = true;
  CornerCase its_case = CornerCase::hidden;
  size_t policy = 0;
  std::optional<size_t> less_policy;
  std::optional<CornerCase> less_case;
  int64_t revealed = 0;  // runs, or differences, with a reveal
  int scenes = 0;
  CornerMeasures at_reveal;
  // For single runs only:
  int64_t ended_early = 0;                               // runs that an infraction ended
  int64_t entered_input = 0;                             // runs in which the hidden vehicle entered the policy's input
  std::array<double, 3> reveal_s{};                      // 10th, 50th and 90th percentiles
  std::array<Estimate, kTakeoverSteps + 1> speed_mps{};  // mean over runs that have not ended
  std::array<int64_t, kTakeoverSteps + 1> driving{};     // number of runs that have not ended
};

/// Returns rows with walls, then without. Each half has the policies' cases, then differences from the first policy,
/// then differences between cases (hidden minus removed, hidden minus empty).
std::vector<CornerRow> summarize(const CornerResults& results);

/// Writes a CSV row per run. Throws Error naming the path.
void write_corner_cases(const std::string& path, const CornerResults& results);

/// Returns one JSON object. `cases_file`: path of the CSV file, or empty.
std::string corner_summary_json(const CornerResults& results, const std::vector<CornerRow>& rows,
                                const std::string& cases_file);

}  // namespace pictura
