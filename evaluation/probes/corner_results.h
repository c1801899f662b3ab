// How policies drove towards blind corners: every run, means over pairs of like corners, and the files that hold them.
// Without torch headers.
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

/// Who is at the corner.
enum class CornerCase : uint8_t {
  hidden,   // a vehicle comes hidden
  removed,  // the same state without it: the control
  empty,    // a like state of another corner where nobody comes
};
constexpr std::array<const char*, 3> kCornerCaseNames{"hidden", "removed", "empty"};
constexpr size_t kCornerCases = kCornerCaseNames.size();
constexpr std::array<const char*, 2> kWallNames{"on", "off"};  // in the order of runs

/// Who is not there in CornerCase::removed.
enum class CornerControl : uint8_t {
  none,       // who comes hidden
  permuted,   // a control: another vehicle near the ego, drawn for each pair; nobody where there is none
  untrained,  // a control: who comes hidden, and policies with fresh weights take over in the same states
};
constexpr std::array<const char*, 3> kCornerControlNames{"none", "permuted", "untrained"};

/// A world at a takeover, for pictures: agents, then parked cars.
struct CornerScene {
  std::vector<AgentBox> boxes;
  std::vector<AgentStatus> status;  // [boxes]
  std::vector<Vec2> user_m;         // [kTakeoverSteps + 1] where the hidden vehicle's box is
  int32_t removed = -1;             // agent that is hidden in CornerCase::removed; -1: none
};

struct CornerResults : ProbeResults {
  CornerSearch search;
  CornerControl control = CornerControl::none;
  int64_t pairs_asked = 0, hidden_found = 0, empty_found = 0;  // states, before they are matched
  std::vector<CornerPair> pairs;                               // by scene, step, ego and user of the hidden state
  std::vector<CornerScene> scenes_of_pairs;                    // [pairs] of the hidden state
  std::vector<Takeover> takeovers;                             // [pairs, walls on and off, cases, policies]
  CompiledMaps maps;                                           // for pictures

  const Takeover& takeover(size_t pair, bool walls, CornerCase its_case, size_t policy) const {
    return takeovers[((pair * 2 + (walls ? 0 : 1)) * kCornerCases + static_cast<size_t>(its_case)) * policies.size() +
                     policy];
  }
};

/// A run at the reveal: where line of sight to the user opens, or to where it would be. At an empty corner it is at
/// the time at which it is for the same policy in the hidden state of the pair.
struct Reveal {
  int32_t step = 0;
  std::optional<float> distance_m;  // to the user, between the boxes' centres
  float corner_m = 0;               // to the corner's entry, by what was driven; negative beyond it
  float speed_mps = 0;
  float approach_mps = 0;                  // mean speed up to here
  std::optional<float> deceleration_mps2;  // of the next 2 s, where the run lasts as long
};
/// Nothing where the run ends before.
std::optional<Reveal> reveal_of(const CornerResults& results, size_t pair, bool walls, CornerCase its_case,
                                size_t policy);

/// The pair at whose reveal policies' speeds differ most, with walls and with who is hidden; else the first.
size_t example_of(const CornerResults& results);

/// What is measured of a run at the reveal, by name in files.
struct CornerMeasures {
  Estimate distance_m, corner_m, speed_mps, approach_mps, deceleration_mps2;
};

/// Of one policy's runs of a case; or the differences of two runs of each pair: from another policy's run of the same
/// state, or from the same policy's run of another case. Estimates are over scenes.
struct CornerRow {
  bool walls = true;
  CornerCase its_case = CornerCase::hidden;
  size_t policy = 0;
  std::optional<size_t> less_policy;
  std::optional<CornerCase> less_case;
  int64_t revealed = 0;  // runs, or pairs of runs, that reach the reveal
  int scenes = 0;
  CornerMeasures at_reveal;
  // Of runs alone:
  int64_t ended_early = 0;                               // by an infraction
  int64_t entered_input = 0;                             // in which the policy read the user
  std::array<double, 3> reveal_s{};                      // 10th, 50th and 90th percentile
  std::array<Estimate, kTakeoverSteps + 1> speed_mps{};  // of those that have not ended
  std::array<int64_t, kTakeoverSteps + 1> driving{};     // how many these are
};

/// With walls and without: for each policy its cases, then each of the others less the first policy, then hidden less
/// removed and hidden less empty.
std::vector<CornerRow> summarize(const CornerResults& results);

/// A row a run, with a header. Throws Error naming the path.
void write_corner_cases(const std::string& path, const CornerResults& results);

/// Results and rows as one JSON object's text; `cases_file` names where the cases are, and may be empty.
std::string corner_summary_json(const CornerResults& results, const std::vector<CornerRow>& rows,
                                const std::string& cases_file);

}  // namespace pictura
