// Progress of an evaluation.
#pragma once

#include <cstddef>
#include <functional>

#include "pictura/common/support/stopwatch.h"

namespace pictura {

class EvaluationClock {
 public:
  /// on_progress(completed fraction, remaining seconds) may be empty. It must outlive the clock.
  explicit EvaluationClock(const std::function<void(double, double)>& on_progress) : on_progress_(on_progress) {}

  /// Reports progress from the second call on, because the time before the first call includes compilation and tuning.
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

/// Returns a progress callback for one of `count` equal parts, after `finished` parts. The callback reports the overall
/// progress to on_progress, which must outlive the callback.
inline std::function<void(double, double)> progress_of_part(const std::function<void(double, double)>& on_progress,
                                                            std::ptrdiff_t finished, std::ptrdiff_t count) {
  return [&on_progress, finished, count](double done, double eta_s) {
    if (done >= 1 && finished + 1 < count) return;  // the duration of a part is no longer known
    const double each_s = done < 1 ? eta_s / (1 - done) : 0;
    on_progress((static_cast<double>(finished) + done) / static_cast<double>(count),
                eta_s + static_cast<double>(count - finished - 1) * each_s);
  };
}

}  // namespace pictura
