// Log of a run: progress.csv, evaluation.csv and TensorBoard events.
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

/// CSV file with a row per update. Complete rows of completed updates in an existing file are kept. A file with other
/// columns is renamed to PATH.1 (or the next free number), with a notice.
class ProgressCsv {
 public:
  ProgressCsv(const std::string& path, const Scalars& columns, int64_t updates_done,
              const std::function<void(const std::string&)>& on_notice);
  /// Appends a row and flushes. Throws Error naming the path if the disk is full.
  void write(int64_t update, const Scalars& scalars);
  /// Update of the last row; 0 without rows.
  int64_t last_update() const { return last_update_; }

 private:
  std::string path_;
  std::ofstream out_;
  int64_t last_update_ = 0;
};

/// Record of one update.
struct UpdateRecord {
  SimulatorTotals totals;  // counts of the rollout
  UpdateStats stats;
  AgentGroups agents;
  double rollout_s = 0, update_s = 0;  // wall times
  PhaseSeconds phases_s{};             // rollout and update
  ImageSize image_size;                // size of the first camera's images; 0 without images
};

/// Results of an evaluation within a run.
struct EvaluationRecord {
  EvaluateRow row;
  std::optional<EvaluateRow> average_row;  // with averaged weights, if the run averages them
  double seconds = 0;
  ImageSize image_size;  // size of the first camera's images; 0 without images
};

class RunLog {
 public:
  /// Opens the files of a run after `updates_done` updates; no files if `folder` is empty. Throws Error naming the
  /// path.
  RunLog(const std::string& folder, const Config& config, int64_t updates_done, int64_t agent_steps,
         const std::vector<RecentUpdate>& recent, const std::function<void(const std::string&)>& on_notice);

  /// Writes row and event of an update. `update` and `agent_steps` are the run's totals after it. Sends a notice for
  /// the first update whose log-probabilities were recomputed.
  TrainProgress add(int64_t update, int64_t agent_steps, const UpdateRecord& record);

  /// Writes row and event of an evaluation after `update` updates.
  void add_evaluation(int64_t update, int64_t agent_steps, const EvaluationRecord& record);
  /// Whether evaluation.csv is written, but its last row is not that of `update`.
  bool lacks_evaluation(int64_t update) const { return evaluation_csv_ && evaluation_csv_->last_update() != update; }
  /// Wall time of evaluations, which rates exclude.
  double evaluation_s() const { return evaluation_s_; }

  /// Last updates.
  std::vector<RecentUpdate> recent() const { return {recent_.begin(), recent_.end()}; }
  /// Mean return of agent episodes in recent(); NaN without any.
  double episode_return() const;

 private:
  void write_event(int64_t agent_steps, const Scalars& scalars);

  const Config config_;
  const int64_t first_update_, first_agent_steps_;
  const std::function<void(const std::string&)> on_notice_;
  bool has_reported_rejected_ = false;
  const std::string folder_;         // empty: no files
  std::optional<EventFile> events_;  // opened by the first event, so that resuming a finished run adds no file
  std::optional<ProgressCsv> csv_;
  std::optional<ProgressCsv> evaluation_csv_;  // null if the run never evaluates
  double evaluation_s_ = 0;
  std::deque<RecentUpdate> recent_;
  // Time since the start, excluding evaluations, and the run's agent-steps then.
  struct Moment {
    double s;
    int64_t agent_steps;
  };
  std::deque<Moment> minute_;
  Stopwatch since_start_;
};

}  // namespace pictura
