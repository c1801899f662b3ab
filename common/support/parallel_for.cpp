#include "pictura/common/support/parallel_for.h"

#include <chrono>
#include <system_error>
#include <thread>
#include <vector>

#include <omp.h>
#include <pthread.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

// Time for which a thread polls for its next loop, or for the end of the other threads, before it sleeps. It is longer
// than the gaps between the loops of a simulation step. It is far below a scheduler's time slice, so that polling takes
// little time from other processes.
constexpr std::chrono::microseconds kSpinTime{50};

void pause_briefly() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Returns once `word` differs from `value`.
void wait_while_equal(const std::atomic<std::uint32_t>& word, std::uint32_t value) {
  const auto end = std::chrono::steady_clock::now() + kSpinTime;
  do {
    for (int i = 0; i < 32; ++i) {
      if (word.load(std::memory_order_acquire) != value) return;
      pause_briefly();
    }
  } while (std::chrono::steady_clock::now() < end);
  word.wait(value, std::memory_order_acquire);
}

/// Worker threads for the loops of one calling thread.
class Team {
 public:
  Team() = default;
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;
  ~Team() {
    is_ending_.store(true, std::memory_order_relaxed);
    num_loops_.fetch_add(1, std::memory_order_release);
    num_loops_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  void run(int num_threads, void (*call)(void*, int), void* body) {
    const std::size_t helpers = add_threads(static_cast<std::size_t>(num_threads) - 1);
    call_ = call;
    body_ = body;
    state_.store(static_cast<std::uint32_t>(helpers) * kPlace, std::memory_order_release);
    num_loops_.fetch_add(1, std::memory_order_release);
    if (helpers == threads_.size()) {
      num_loops_.notify_all();
    } else {
      for (std::size_t i = 0; i < helpers; ++i) num_loops_.notify_one();
    }
    call(body, 0);
    // From here on, no further threads may begin.
    std::uint32_t state = state_.fetch_and(kPlace - 1, std::memory_order_acq_rel) & (kPlace - 1);
    for (; state != 0; state = state_.load(std::memory_order_acquire)) wait_while_equal(state_, state);
  }

 private:
  static constexpr std::uint32_t kPlace = 1 << 16;  // above the number of working threads

  // Starts threads up to `wanted`, and returns how many exist, because the system may refuse to start more.
  std::size_t add_threads(std::size_t wanted) {
    try {
      while (threads_.size() < wanted) threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
    }
    return std::min(wanted, threads_.size());
  }

  void work();

  // If a loop has a free place, takes it and returns the number of the place; otherwise returns 0.
  int join_loop() {
    std::uint32_t state = state_.load(std::memory_order_acquire);
    while (state >= kPlace) {
      if (state_.compare_exchange_weak(state, state - kPlace + 1, std::memory_order_acq_rel)) {
        return static_cast<int>(state / kPlace);
      }
    }
    return 0;
  }

  std::vector<std::thread> threads_;
  std::atomic<bool> is_ending_ = false;
  std::atomic<std::uint32_t> num_loops_ = 0;  // number of loops so far; idle threads sleep until it changes
  std::atomic<std::uint32_t> state_ = 0;      // kPlace per free place in the loop, 1 per working thread
  // Function of the current loop and its argument. They are set while no thread is working.
  void (*call_)(void*, int) = nullptr;
  void* body_ = nullptr;
};

thread_local bool is_in_loop = false;
thread_local std::unique_ptr<Team> own_team;

void Team::work() {
  is_in_loop = true;
  for (;;) {
    const std::uint32_t seen = num_loops_.load(std::memory_order_acquire);
    if (is_ending_.load(std::memory_order_relaxed)) return;
    if (const int number = join_loop(); number > 0) {
      call_(body_, number);
      if (state_.fetch_sub(1, std::memory_order_acq_rel) == 1) state_.notify_one();
    } else {
      wait_while_equal(num_loops_, seen);
    }
  }
}

Team& team_of_this_thread() {
  // A forked process has no worker threads, so it abandons this team and starts its own team.
  static const int at_fork = pthread_atfork(nullptr, nullptr, [] { static_cast<void>(own_team.release()); });
  static_cast<void>(at_fork);
  if (!own_team) own_team = std::make_unique<Team>();
  return *own_team;
}

}  // namespace

int resolve_num_threads(int num_threads) {
  PICTURA_CHECK(num_threads >= 0 && num_threads <= kMaxThreads, "threads: expected 0 (all) to {}, got {}", kMaxThreads,
                num_threads);
  return num_threads > 0 ? num_threads : std::min(omp_get_max_threads(), kMaxThreads);
}

void run_on_threads(int num_threads, void (*call)(void*, int), void* body) {
  if (num_threads <= 1 || is_in_loop) {
    call(body, 0);
    return;
  }
  is_in_loop = true;
  team_of_this_thread().run(num_threads, call, body);
  is_in_loop = false;
}

}  // namespace pictura
