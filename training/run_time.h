// Time limit of a run.
#pragma once

#include <string>

#include "pictura/common/support/stopwatch.h"
#include "pictura/training/loop.h"
#include "pictura/training/run.h"

namespace pictura {

enum class RunWork { update, evaluation };

class RunTime {
 public:
  /// minutes: limit of wall time since `start`; 0: none. Run::longest_update_s holds the durations, also from earlier
  /// processes on equal devices with equally many agents. The run must outlive this object.
  RunTime(double minutes, const Stopwatch& start, Run* run);

  /// Whether further work would exceed the limit on any rank if it took 1.2 times the longest duration so far.
  /// Collective: every rank must call it.
  bool would_exceed_limit(RunWork work) const;
  void add(RunWork work, double seconds);
  /// Multiplies expected durations by `times`. The next update then counts as the longest, even if it is shorter.
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
