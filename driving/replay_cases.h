// Cases of probes as replays: the scene driven again, with the road user that the case is about marked.
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
  std::optional<int64_t> number;  // of the case, as in cases.csv; nothing: see write_case_replay()
  RecordingOptions recording;     // whom it follows is the case's ego
};

/// Throws UsageError where there is no case of the number that was asked for among `count`. A probe's number of cases
/// may be known only in the end: before, `count` is the most that there can be.
void check_case_number(const CaseReplayOptions& options, int64_t count);

/// Drives the case's scene again, on the host, by whom it was driven and in the world of the first policy, and writes
/// the replay. Of corners, whose cases are pairs, it is the takeover of the first policy in the hidden state. Says on
/// stderr what it writes, and whether the ego is driven otherwise than it was probed. Without a number it is the case
/// in which the first policy's value changes most; of corners example_of(). Throws UsageError where there is no such
/// case.
void write_case_replay(const CaseReplayOptions& options, const RemovalOptions& probe, const RemovalResults& results);
void write_case_replay(const CaseReplayOptions& options, const PedestrianOptions& probe,
                       const PedestrianResults& results);
void write_case_replay(const CaseReplayOptions& options, const CornerOptions& probe, const CornerResults& results);

}  // namespace pictura
