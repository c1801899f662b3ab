// Time of a run: how long its updates and evaluations take on this machine, and whether one more ends within the time
// that the run was given.
#pragma once

#include <string>

#include "pictura/common/support/stopwatch.h"
#include "pictura/training/loop.h"
#include "pictura/training/run.h"

namespace pictura {

enum class RunWork { update, evaluation };

class RunTime {
 public:
  /// `minutes` of wall time since `start`, 0: without end. What work takes is kept with the run, which must outlive
  /// this (Run::longest_update_s), so that it is known from its first update on where it was on such a machine before.
  RunTime(double minutes, const Stopwatch& start, Run* run);

  /// Whether more of the work, as long as the longest before, would end too late on some rank. Collective: every rank
  /// must call it.
  bool is_too_short_for(RunWork work) const;
  /// Records how long work took.
  void add(RunWork work, double seconds);
  /// Expects work to take so many times as long, until it is measured anew.
  void expect_growth(double times);
  /// Limits progress->eta_s to the time that is left.
  void bound(TrainProgress* progress) const;

 private:
  std::string key(RunWork work) const;
  double left_s() const { return 60 * minutes_ - start_.seconds(); }

  const double minutes_;
  const Stopwatch start_;
  Run& run_;
  const std::string machine_;
  double own_longest_update_s_ = 0;  // of this process
};

}  // namespace pictura
