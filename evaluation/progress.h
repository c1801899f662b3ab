// Progress of an evaluation: the completed fraction and the remaining time. Has no torch headers.
#pragma once

#include <functional>

#include "pictura/common/support/stopwatch.h"

namespace pictura {

class EvaluationClock {
 public:
  /// Creates a clock. on_progress(completed fraction, remaining seconds) may be empty.
  explicit EvaluationClock(const std::function<void(double, double)>& on_progress) : on_progress_(on_progress) {}

  /// Reports progress from the second call on: the first step compiles and tunes, so its duration does not predict the
  /// others.
  void update(double fraction) {
    if (!on_progress_) return;
    if (first_s_ < 0) {
      first_s_ = since_start_.seconds();
      first_fraction_ = fraction;
    } else if (fraction > first_fraction_) {
      on_progress_(fraction, (since_start_.seconds() - first_s_) * (1 - fraction) / (fraction - first_fraction_));
    }
  }
  void finish() {
    if (on_progress_) on_progress_(1, 0);
  }
  double seconds() const { return since_start_.seconds(); }

 private:
  const std::function<void(double, double)>& on_progress_;
  const Stopwatch since_start_;
  double first_s_ = -1, first_fraction_ = 0;
};

}  // namespace pictura
