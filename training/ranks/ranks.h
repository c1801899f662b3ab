// Ranks: the processes of a training run. They exchange heartbeats through a key-value store, and detect that a rank
// ends or hangs.
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
  double silent_s = 20;       // without a heartbeat: the process was killed or stopped
  double no_progress_s = 45;  // with heartbeats but no step: the rank hangs
};

class Ranks {
 public:
  /// Waits until all ranks have joined. Throws Error if they cannot meet, if ranks did not join, or if two processes
  /// claim a rank.
  explicit Ranks(const Launch& launch, const RankTimeouts& timeouts = {});
  /// Waits briefly for other ranks if this process hosts the store.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  const Launch& launch() const { return launch_; }
  int rank() const { return launch_.rank; }
  int size() const { return launch_.size; }

  /// Counts a step; all ranks must take equally many. Throws RankLost, naming the rank, if a rank is lost.
  void step();
  /// Throws as step() does, without counting a step.
  void check() const;
  /// Call it after a failed collective operation. Throws RankLost as soon as the lost rank is known; returns if none is
  /// lost.
  void throw_if_lost() const;
  /// Announces to other ranks why this process ends. Only the first call counts.
  void announce(const std::string& why) noexcept;

  /// Runs with long steps need a longer time than the default.
  void set_no_progress_s(double seconds) { no_progress_s_ = seconds; }

  /// Scope in which this process does not count as hanging.
  class LongWork {
   public:
    explicit LongWork(Ranks* ranks) : ranks_(ranks) { ++ranks_->busy_; }
    ~LongWork() { --ranks_->busy_; }
    LongWork(const LongWork&) = delete;
    LongWork& operator=(const LongWork&) = delete;

   private:
    Ranks* ranks_;
  };

  /// Returns every rank's text, in the order of ranks. Each key can be used once. Collective: every rank must call it.
  std::vector<std::string> texts(const std::string& key, const std::string& own);

  /// Store for process groups; null with a single rank.
  const c10::intrusive_ptr<c10d::Store>& store() const { return store_; }
  /// Sets the function that another thread calls when a rank is lost, to end waiting calls; an empty function removes
  /// it.
  void on_lost(std::function<void()> abort);

 private:
  void join();
  void watch();
  void mark_lost(const std::string& why);

  const Launch launch_;
  const RankTimeouts timeouts_;
  c10::intrusive_ptr<c10d::Store> store_, watch_store_;
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
