// Time of a run: durations of its updates and evaluations on this machine, and whether another update or evaluation
// would end within the run's time limit.
#pragma once

#include <string>

#include "pictura/common/support/stopwatch.h"
#include "pictura/training/loop.h"
#include "pictura/training/run.h"

namespace pictura {

enum class RunWork { update, evaluation };

class RunTime {
 public:
  /// Limits the run to `minutes` of wall time since `start`; 0: no limit. Durations are stored in the run
  /// (Run::longest_update_s), which must outlive this object, keyed by device and number of agents. They are known from
  /// the first update if the run used the same device and number of agents before.
  RunTime(double minutes, const Stopwatch& start, Run* run);

  /// Whether another piece of the work, as long as the longest so far, would exceed the limit on any rank. Collective:
  /// every rank must call it.
  bool would_exceed_limit(RunWork work) const;
  /// Records the duration of work.
  void add(RunWork work, double seconds);
  /// Scales the expected duration of work by `times`, until it is measured again.
  void scale_expected_duration(double times);
  /// Limits progress->eta_s to the remaining time.
  void limit_eta(TrainProgress* progress) const;

 private:
  std::string key(RunWork work) const;
  double left_s() const { return 60 * minutes_ - start_.seconds(); }

  const double minutes_;
  const Stopwatch start_;
  Run& run_;
  const std::string machine_;
  double own_longest_update_s_ = 0;  // longest update of this process
};

}  // namespace pictura
