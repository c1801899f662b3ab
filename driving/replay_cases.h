// Writes replays of cases of probes. A probe tests policies' responses to road users. The scene of the case is
// simulated again, and the replay marks the case's road user.
#pragma once

#include <optional>
#include <string>

#include "pictura/driving/recording.h"
#include "pictura/evaluation/probes/corner.h"
#include "pictura/evaluation/probes/pedestrian.h"
#include "pictura/evaluation/probes/removal.h"

namespace pictura {

struct CaseReplayOptions {
  std::string path;  // path of the replay; if empty, none is written
  // Number of the case in cases.csv. If empty, write_case_replay() chooses the case.
  std::optional<int64_t> number;
  RecordingOptions recording;  // the recording follows the case's ego
};

/// Throws UsageError if the requested case number is not below `count`. A caller may check before a probe runs; then
/// `count` is the maximum number of the probe's cases.
void check_case_number(const CaseReplayOptions& options, int64_t count);

/// Simulates the case's scene again on the host, with the scene's driver and in the world configuration of the first
/// policy, and writes the replay. Reports the file on stderr, and whether the ego drives differently than in the probe.
/// Without a case number, chooses the case with the largest change in the first policy's value. Throws UsageError if
/// the case does not exist.
void write_case_replay(const CaseReplayOptions& options, const RemovalOptions& probe, const RemovalResults& results);
void write_case_replay(const CaseReplayOptions& options, const PedestrianOptions& probe,
                       const PedestrianResults& results);
/// Variant for probes of blind corners, whose cases are pairs of states. In the replay, the first policy takes over the
/// ego in the state with the hidden road user. Without a case number, example_of() chooses the pair.
void write_case_replay(const CaseReplayOptions& options, const CornerOptions& probe, const CornerResults& results);

}  // namespace pictura
