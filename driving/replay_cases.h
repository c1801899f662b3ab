// Writes replays of probe cases, in which the case's road user is marked.
#pragma once

#include <optional>
#include <string>

#include "pictura/driving/recording.h"
#include "pictura/evaluation/probes/corner.h"
#include "pictura/evaluation/probes/pedestrian.h"
#include "pictura/evaluation/probes/removal.h"

namespace pictura {

struct CaseReplayOptions {
  std::string path;  // if empty, no replay is written
  // Number in cases.csv. If empty, write_case_replay() chooses the case.
  std::optional<int64_t> number;
  RecordingOptions recording;  // follows the case's ego
};

/// Throws UsageError if the case number is not below `count`. Before a probe, `count` is the maximum number of cases.
void check_case_number(const CaseReplayOptions& options, int64_t count);

/// Simulates the case's scene again on the host, with the scene's driver and the first policy's world configuration.
/// Reports the file on stderr, and the ego's speed if it differs from that in the probe. Without a number, chooses the
/// case that changes the first policy's value most. Throws UsageError if the case does not exist.
void write_case_replay(const CaseReplayOptions& options, const RemovalOptions& probe, const RemovalResults& results);
void write_case_replay(const CaseReplayOptions& options, const PedestrianOptions& probe,
                       const PedestrianResults& results);
/// A case is a pair of states. The first policy takes over the ego in the state with the hidden vehicle. Without a
/// number, example_of() chooses the pair.
void write_case_replay(const CaseReplayOptions& options, const CornerOptions& probe, const CornerResults& results);

}  // namespace pictura
