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
  /// Limits the run to `minutes` of wall time since `start`; 0: no limit. Durations are stored in
  /// Run::longest_update_s, by device and number of agents; the run must outlive this object. If the run used the same
  /// device and number of agents before, durations are known from the start.
  RunTime(double minutes, const Stopwatch& start, Run* run);

  /// Returns whether another update or evaluation would exceed the limit on any rank, if it took 20 % more time than
  /// the longest so far. Collective: every rank must call it.
  bool would_exceed_limit(RunWork work) const;
  /// Records the duration of one update or evaluation.
  void add(RunWork work, double seconds);
  /// Multiplies the expected durations of updates and evaluations by `times`. The next update's duration replaces the
  /// expected duration of updates.
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
