// Log of a run: after each update a row of progress.csv, a TensorBoard event and the numbers of the progress line;
// after each evaluation a row of evaluation.csv and an event.
#pragma once

#include <deque>
#include <optional>

#include "pictura/common/support/stopwatch.h"
#include "pictura/evaluation/results.h"
#include "pictura/training/agent_groups.h"
#include "pictura/training/checkpoint.h"
#include "pictura/training/event_file.h"
#include "pictura/training/loop.h"
#include "pictura/training/phase_timer.h"
#include "pictura/training/ppo.h"

namespace pictura {

/// CSV file of a run with a row per update. It keeps those rows of an existing file that are complete and belong to
/// completed updates. A row is incomplete if the process was killed or the disk was full. A file with other columns is
/// renamed to PATH.1 (or the next free number), with a notice.
class ProgressCsv {
 public:
  ProgressCsv(const std::string& path, const Scalars& columns, int64_t updates_done,
              const std::function<void(const std::string&)>& on_notice);
  /// Appends a row and flushes. Throws Error naming the path if the disk is full.
  void write(int64_t update, const Scalars& scalars);
  /// Returns the update of the last row; 0 without rows.
  int64_t last_update() const { return last_update_; }

 private:
  std::string path_;
  std::ofstream out_;
  int64_t last_update_ = 0;
};

/// Record of one update.
struct UpdateRecord {
  SimulatorTotals totals;  // counts of the update's rollout
  UpdateStats stats;
  AgentGroups agents;
  double rollout_s = 0, update_s = 0;  // wall times of the rollout and of the update
  PhaseSeconds phases_s{};             // times of the phases of rollout and update
  ImageSize image_size;                // size of the first camera's images; 0 without images
};

/// Results of an evaluation within a run.
struct EvaluationRecord {
  EvaluateRow row;
  std::optional<EvaluateRow> average_row;  // with averaged weights, for runs that average them
  double seconds = 0;                      // wall time
  ImageSize image_size;                    // size of the first camera's images; 0 without images
};

class RunLog {
 public:
  /// Opens the files of a run that has completed `updates_done` updates with `agent_steps` agent-steps. If `folder` is
  /// an empty text, the log writes no files. Throws Error naming the path.
  RunLog(const std::string& folder, const Config& config, int64_t updates_done, int64_t agent_steps,
         const std::vector<RecentUpdate>& recent, const std::function<void(const std::string&)>& on_notice);

  /// Writes the row and the event of an update, after which the run has `update` updates and `agent_steps` agent-steps.
  /// Sends a notice for the first update whose log-probabilities were recomputed.
  TrainProgress add(int64_t update, int64_t agent_steps, const UpdateRecord& record);

  /// Writes the row and the event of an evaluation after `update` updates. Rates exclude the evaluation's time.
  void add_evaluation(int64_t update, int64_t agent_steps, const EvaluationRecord& record);
  /// Whether evaluation.csv lacks a row after `update` updates; false without such a file.
  bool lacks_evaluation(int64_t update) const { return evaluation_csv_ && evaluation_csv_->last_update() != update; }
  /// Wall time of this process's evaluations.
  double evaluation_s() const { return evaluation_s_; }

  /// Returns the last updates. episode_return() is a mean over them.
  std::vector<RecentUpdate> recent() const { return {recent_.begin(), recent_.end()}; }
  /// Mean return of agent episodes that ended in the last updates; NaN without such episodes.
  double episode_return() const;

 private:
  const Config config_;
  const int64_t first_update_, first_agent_steps_;
  const std::function<void(const std::string&)> on_notice_;
  bool has_reported_rejected_ = false;
  std::optional<EventFile> events_;
  std::optional<ProgressCsv> csv_;
  std::optional<ProgressCsv> evaluation_csv_;  // only if the run evaluates
  double evaluation_s_ = 0;
  std::deque<RecentUpdate> recent_;
  // A point in time, and the number of agent-steps until then. The time excludes evaluations.
  struct Moment {
    double s;
    int64_t agent_steps;
  };
  std::deque<Moment> minute_;
  Stopwatch since_start_;
};

}  // namespace pictura
