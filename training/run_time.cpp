#include "pictura/training/run_time.h"

#include <algorithm>

#include <fmt/format.h>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/training/ranks/agree.h"

namespace pictura {

RunTime::RunTime(double minutes, const Stopwatch& start, Run* run)
    : minutes_(minutes),
      start_(start),
      run_(*run),
      machine_(fmt::format("{}, {} agents", product_name(run->device), run->simulator->num_slots())) {}

std::string RunTime::key(RunWork work) const {
  return work == RunWork::evaluation ? machine_ + ", evaluation" : machine_;
}

bool RunTime::would_exceed_limit(RunWork work) const {
  // The expected duration is 20 % more than the longest so far, to allow for longer updates and for saving.
  const auto longest = run_.longest_update_s.find(key(work));
  const double expected_s = longest == run_.longest_update_s.end() ? 0 : 1.2 * longest->second;
  return any_rank(minutes_ > 0 && expected_s > left_s(), run_.communicator);
}

void RunTime::add(RunWork work, double seconds) {
  double& longest_s = run_.longest_update_s[key(work)];
  if (work == RunWork::update) {
    // The longest update of an earlier process counts until this process has completed one.
    longest_s = own_longest_update_s_ = std::max(own_longest_update_s_, seconds);
  } else {
    longest_s = std::max(longest_s, seconds);
  }
}

void RunTime::scale_expected_duration(double times) {
  own_longest_update_s_ = 0;
  for (const RunWork work : {RunWork::update, RunWork::evaluation}) {
    const auto longest = run_.longest_update_s.find(key(work));
    if (longest != run_.longest_update_s.end()) longest->second *= times;
  }
}

void RunTime::limit_eta(TrainProgress* progress) const {
  if (minutes_ == 0 || left_s() >= progress->eta_s) return;
  progress->eta_s = std::max(0.0, left_s());
  progress->ends_by_minutes = true;
}

}  // namespace pictura
