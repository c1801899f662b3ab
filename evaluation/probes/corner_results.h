// Results of policies at blind corners: every run, means over pairs of similar corners, and files of both. Includes no
// torch headers.
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

/// Situation at the corner in a run.
enum class CornerCase : uint8_t {
  hidden,   // a hidden vehicle comes
  removed,  // the control: the same state after removal of the hidden vehicle
  empty,    // a similar state at a corner from which no vehicle comes
};
constexpr std::array<const char*, 3> kCornerCaseNames{"hidden", "removed", "empty"};
constexpr size_t kCornerCases = kCornerCaseNames.size();
constexpr std::array<const char*, 2> kWallNames{"on", "off"};  // with walls, without walls: the order of runs

/// Vehicle that is removed in CornerCase::removed.
enum class CornerControl : uint8_t {
  none,      // the hidden vehicle
  permuted,  // a control: another vehicle near the ego, drawn at random for each pair; none if no other vehicle is near
  untrained,  // a control: the hidden vehicle; policies with fresh weights drive in the same states
};
constexpr std::array<const char*, 3> kCornerControlNames{"none", "permuted", "untrained"};

/// World in the state in which a policy takes over the ego, for figures. Boxes of agents come first, then those of
/// parked cars.
struct CornerScene {
  std::vector<AgentBox> boxes;
  std::vector<AgentStatus> status;  // [boxes]
  std::vector<Vec2> user_m;         // [kTakeoverSteps + 1] position of the hidden vehicle's box
  int32_t removed = -1;             // agent that is removed in CornerCase::removed; -1: none
};

struct CornerResults : ProbeResults {
  CornerSearch search;
  CornerControl control = CornerControl::none;
  int64_t pairs_asked = 0, hidden_found = 0, empty_found = 0;  // found: numbers of states before matching
  std::vector<CornerPair> pairs;             // ordered by scene, step, ego and user of the hidden state
  std::vector<CornerScene> scenes_of_pairs;  // [pairs] scene of the hidden state
  std::vector<Takeover> takeovers;           // [pairs, walls on and off, cases, policies]
  CompiledMaps maps;                         // for figures

  const Takeover& takeover(size_t pair, bool walls, CornerCase its_case, size_t policy) const {
    return takeovers[((pair * 2 + (walls ? 0 : 1)) * kCornerCases + static_cast<size_t>(its_case)) * policies.size() +
                     policy];
  }
};

/// Reveal of a run: the step at which the ego's line of sight opens to the hidden vehicle, or to the place where the
/// removed vehicle would be. In a run at an empty corner, it is the step of the reveal in the same policy's run of
/// CornerCase::hidden.
struct Reveal {
  int32_t step = 0;
  std::optional<float> distance_m;  // from ego to hidden vehicle, between the boxes' centres
  float corner_m = 0;  // remaining distance along the driven path to the corner's entry; negative beyond the entry
  float speed_mps = 0;
  float approach_mps = 0;                  // mean speed up to the reveal
  std::optional<float> deceleration_mps2;  // mean over the 2 s after the reveal, if the run lasts that long
};
/// Returns the reveal of a run; empty if the run ends before the reveal.
std::optional<Reveal> reveal_of(const CornerResults& results, size_t pair, bool walls, CornerCase its_case,
                                size_t policy);

/// Returns an example pair for figures: in runs with walls and the hidden vehicle, this pair has the largest difference
/// between the policies' speeds at the reveal. Returns the first pair if no pair has a reveal for every policy.
size_t example_of(const CornerResults& results);

/// Measures of a run at the reveal, by their names in files.
struct CornerMeasures {
  Estimate distance_m, corner_m, speed_mps, approach_mps, deceleration_mps2;
};

/// Statistics of one policy's runs of a case, or of differences between two runs of each pair. A difference subtracts
/// less_policy's run of the same case, or the same policy's run of less_case. Estimates are over scenes.
struct CornerRow {
  bool walls = true;
  CornerCase its_case = CornerCase::hidden;
  size_t policy = 0;
  std::optional<size_t> less_policy;
  std::optional<CornerCase> less_case;
  int64_t revealed = 0;  // runs, or pairs of runs, with a reveal
  int scenes = 0;
  CornerMeasures at_reveal;
  // Values of single runs only:
  int64_t ended_early = 0;           // runs that an infraction ended
  int64_t entered_input = 0;         // runs in which the hidden vehicle appeared in the policy's input
  std::array<double, 3> reveal_s{};  // 10th, 50th and 90th percentile
  std::array<Estimate, kTakeoverSteps + 1> speed_mps{};  // mean over runs that have not ended
  std::array<int64_t, kTakeoverSteps + 1> driving{};     // number of runs that have not ended
};

/// Returns the rows of runs with walls, then of runs without walls. Each half has three kinds of rows: one row per
/// policy and case; differences of each further policy from the first policy; and each policy's differences between
/// cases (hidden minus removed, and hidden minus empty).
std::vector<CornerRow> summarize(const CornerResults& results);

/// Writes a CSV file with a header and a row for each run. Throws Error naming the path.
void write_corner_cases(const std::string& path, const CornerResults& results);

/// Returns results and rows as the text of one JSON object. `cases_file` is the path of the file of cases; it may be
/// empty.
std::string corner_summary_json(const CornerResults& results, const std::vector<CornerRow>& rows,
                                const std::string& cases_file);

}  // namespace pictura
