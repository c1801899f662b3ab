// Replays of probes' cases: the scene is driven again, and the case's road user is marked.
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
  RecordingOptions recording;     // options of the recording, which follows the case's ego
};

/// Throws UsageError if the requested case number is not below `count`. Before a probe has run, `count` is the maximum
/// number of its cases.
void check_case_number(const CaseReplayOptions& options, int64_t count);

/// Drives the case's scene again on the host, by the scene's driver and in the world of the first policy, and writes
/// the replay. Cases of corners are pairs; their replay is the takeover by the first policy from the hidden state.
/// Reports the file on stderr, and whether the ego is driven differently than in the probe. Without a case number, the
/// case with the largest change in the first policy's value is chosen; for corners, example_of() chooses. Throws
/// UsageError if the case does not exist.
void write_case_replay(const CaseReplayOptions& options, const RemovalOptions& probe, const RemovalResults& results);
void write_case_replay(const CaseReplayOptions& options, const PedestrianOptions& probe,
                       const PedestrianResults& results);
void write_case_replay(const CaseReplayOptions& options, const CornerOptions& probe, const CornerResults& results);

}  // namespace pictura
