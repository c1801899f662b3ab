// Ranks: the processes of a training run. They meet in a key-value store. Each rank writes heartbeats and its progress
// to the store, and detects there whether other ranks ended or hang. Joint computations use a Communicator.
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
  double join_s = 300;        // maximum time until all ranks have joined
  double silent_s = 20;       // time without a heartbeat: the process was killed or stopped, or its host failed
  double no_progress_s = 45;  // time with heartbeats but no step: the rank hangs; see Ranks::set_no_progress_s()
};

class Ranks {
 public:
  /// Waits until all ranks have joined. Throws Error naming address and port if they cannot meet. Throws Error naming
  /// ranks that did not join, or a rank that two processes claim.
  explicit Ranks(const Launch& launch, const RankTimeouts& timeouts = {});
  /// Waits briefly for the other ranks if this process hosts the store.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  const Launch& launch() const { return launch_; }
  int rank() const { return launch_.rank; }
  int size() const { return launch_.size; }

  /// Counts a step of this process. All ranks must take equally many steps. Throws RankLost, naming the rank, if a rank
  /// is lost.
  void step();
  /// Throws RankLost as step() does, without counting a step.
  void check() const;
  /// Call it after a collective operation has failed. Waits until the lost rank is identified, and throws RankLost.
  /// Returns if no rank is lost.
  void throw_if_lost() const;
  /// Announces to the other ranks why this process ends. Only the first announcement counts.
  void announce(const std::string& why) noexcept;

  /// Sets the time without a step after which a rank is considered to hang. Runs with long steps need a longer time.
  void set_no_progress_s(double seconds) { no_progress_s_ = seconds; }

  /// Scope of long work: within it, this process is not considered to hang even if it takes no step.
  class LongWork {
   public:
    explicit LongWork(Ranks* ranks) : ranks_(ranks) { ++ranks_->busy_; }
    ~LongWork() { --ranks_->busy_; }
    LongWork(const LongWork&) = delete;
    LongWork& operator=(const LongWork&) = delete;

   private:
    Ranks* ranks_;
  };

  /// Returns every rank's text `own`, in the order of ranks. Each key can be used only once. Collective: every rank
  /// must call it.
  std::vector<std::string> texts(const std::string& key, const std::string& own);

  /// Store for process groups; null with a single rank.
  const c10::intrusive_ptr<c10d::Store>& store() const { return store_; }
  /// Sets the function that is called from another thread when a rank is lost, so that waiting calls end. It replaces
  /// the previous function; an empty function removes it.
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
