// Ranks: the processes of a training run. They meet in a key-value store, in which each rank writes heartbeats and
// progress, and finds other ranks that ended or hang. Joint computations use a Communicator.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <torch/csrc/distributed/c10d/Store.hpp>

#include "pictura/common/error_types.h"
#include "pictura/training/ranks/launch.h"

namespace pictura {

/// Error of a rank that ended, hangs, or cannot be reached.
class RankLost : public Error {
 public:
  using Error::Error;
};

/// Time limits for other ranks.
struct RankTimeouts {
  double join_s = 300;        // until all ranks have joined
  double silent_s = 20;       // without a heartbeat: the process was killed or stopped, or its host is gone
  double no_progress_s = 45;  // with heartbeats, but without a step: the rank hangs; see Ranks::set_no_progress_s()
};

class Ranks {
 public:
  /// Waits until all ranks have joined. Throws Error naming address and port if they cannot meet, the ranks that did
  /// not join, and a rank that two processes claim.
  explicit Ranks(const Launch& launch, const RankTimeouts& timeouts = {});
  /// Waits briefly for the other ranks if this process hosts the store.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  const Launch& launch() const { return launch_; }
  int rank() const { return launch_.rank; }
  int size() const { return launch_.size; }

  /// Counts a step of this process. All ranks must take equally many. Throws RankLost, naming the rank, if a rank is
  /// lost.
  void step();
  /// Throws RankLost as step() does, without counting a step.
  void check() const;
  /// Waits until a lost rank is identified, after a collective operation has failed, and throws RankLost. Returns if no
  /// rank is lost.
  void throw_if_lost() const;
  /// Announces the reason why this process ends to the other ranks. The first announcement counts.
  void announce(const std::string& why) noexcept;

  /// Sets the time without a step after which a rank is considered to hang. For runs with long steps.
  void set_no_progress_s(double seconds) { no_progress_s_ = seconds; }

  /// Scope in which this process takes no step for long without being considered to hang.
  class LongWork {
   public:
    explicit LongWork(Ranks* ranks) : ranks_(ranks) { ++ranks_->busy_; }
    ~LongWork() { --ranks_->busy_; }
    LongWork(const LongWork&) = delete;
    LongWork& operator=(const LongWork&) = delete;

   private:
    Ranks* ranks_;
  };

  /// Every rank's text under a key that is used once, in the order of ranks. Collective: every rank must call it.
  std::vector<std::string> texts(const std::string& key, const std::string& own);

  /// Store for process groups; null with a single rank.
  const c10::intrusive_ptr<c10d::Store>& store() const { return store_; }
  /// Sets the function that is called from another thread when a rank is lost, so that waiting calls end. One function
  /// at a time; empty: none.
  void on_lost(std::function<void()> abort);

 private:
  void join();
  void watch();
  void mark_lost(const std::string& why);

  const Launch launch_;
  const RankTimeouts timeouts_;
  c10::intrusive_ptr<c10d::Store> store_, watch_store_;  // watch_store_ is used by the watching thread only
  std::atomic<double> no_progress_s_;
  std::atomic<int64_t> steps_ = 0;
  std::atomic<int> busy_ = 0;
  std::atomic<bool> is_lost_ = false;
  mutable std::mutex mutex_;  // guards the members below
  mutable std::condition_variable changed_;
  bool ends_ = false;
  std::string why_lost_;
  std::function<void()> abort_;
  std::thread watcher_;
};

}  // namespace pictura
