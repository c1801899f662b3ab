// Ranks: the processes of a training run. They meet in a key-value store, where each writes that it is alive and goes
// on, and finds out which others ended or hang. What they compute together goes through a Communicator.
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

/// Another rank ended or hangs, or cannot be reached.
class RankLost : public Error {
 public:
  using Error::Error;
};

/// Time limits for other ranks.
struct Patience {
  double join_s = 300;        // until all are there
  double silent_s = 20;       // without a heartbeat: the process was killed or stopped, or its host is gone
  double no_progress_s = 45;  // with heartbeats, but without a step: it hangs; Ranks::set_no_progress_s
};

class Ranks {
 public:
  /// Waits until all ranks have joined. Throws Error naming address and port where they cannot meet, the ranks that did
  /// not come, and a rank that two processes claim.
  explicit Ranks(const Launch& launch, const Patience& patience = {});
  /// Waits a moment for the other ranks where they meet at this process.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  const Launch& launch() const { return launch_; }
  int rank() const { return launch_.rank; }
  int size() const { return launch_.size; }

  /// Counts a step of this process, of which all ranks take equally many. Throws RankLost, naming the rank, where
  /// another one is lost.
  void step();
  /// Throws RankLost as step() does, without a step.
  void check() const;
  /// Waits until the loss of a rank is found, after an operation with the others has failed, and throws RankLost.
  /// Returns where no rank is lost.
  void find_lost() const;
  /// Announces to the other ranks why this process ends. The first announcement counts.
  void announce(const std::string& why) noexcept;

  /// Sets the time without a step after which a rank is taken for one that hangs, where steps may take longer.
  void set_no_progress_s(double seconds) { no_progress_s_ = seconds; }

  /// Scope in which this process takes no step for long, and is not taken for one that hangs.
  class LongWork {
   public:
    explicit LongWork(Ranks* ranks) : ranks_(ranks) { ++ranks_->busy_; }
    ~LongWork() { --ranks_->busy_; }
    LongWork(const LongWork&) = delete;
    LongWork& operator=(const LongWork&) = delete;

   private:
    Ranks* ranks_;
  };

  /// Every rank's text under a key that is used once, in order of ranks. Collective: every rank must call it.
  std::vector<std::string> texts(const std::string& key, const std::string& own);

  /// Store for process groups; null where there is one rank alone.
  const c10::intrusive_ptr<c10d::Store>& store() const { return store_; }
  /// Sets what is called from another thread when a rank is lost, so that calls that wait for it end. One at a time;
  /// empty: none.
  void on_lost(std::function<void()> abort);

 private:
  void join();
  void watch();
  void lose(const std::string& why);

  const Launch launch_;
  const Patience patience_;
  c10::intrusive_ptr<c10d::Store> store_, watch_store_;  // the latter for the thread alone
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
