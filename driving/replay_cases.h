// Cases of probes as replays: the scene is driven again, with the case's road user marked.
#pragma once

#include <optional>
#include <string>

#include "pictura/driving/recording.h"
#include "pictura/evaluation/probes/corner.h"
#include "pictura/evaluation/probes/pedestrian.h"
#include "pictura/evaluation/probes/removal.h"

namespace pictura {

struct CaseReplayOptions {
  std::string path;               // empty: no replay
  std::optional<int64_t> number;  // number of the case in cases.csv; empty: see write_case_replay()
  RecordingOptions recording;     // its followed agent is replaced by the case's ego
};

/// Throws UsageError if the requested case number is not below `count`. A probe may know its number of cases only at
/// its end; before, `count` is the maximum.
void check_case_number(const CaseReplayOptions& options, int64_t count);

/// Drives the case's scene again, on the host, by its driver and in the world of the first policy, and writes the
/// replay. For corners, whose cases are pairs, the replay is the takeover of the first policy in the hidden state.
/// Reports the file on stderr, and whether the ego is driven differently than in the probe. Without a number the case
/// is the one with the largest change in the first policy's value; for corners example_of(). Throws UsageError if the
/// case does not exist.
void write_case_replay(const CaseReplayOptions& options, const RemovalOptions& probe, const RemovalResults& results);
void write_case_replay(const CaseReplayOptions& options, const PedestrianOptions& probe,
                       const PedestrianResults& results);
void write_case_replay(const CaseReplayOptions& options, const CornerOptions& probe, const CornerResults& results);

}  // namespace pictura
