// Parallel loops on the host. If bodies throw, the caller receives the exception of the lowest item.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <type_traits>

#include "pictura/common/error_types.h"

namespace pictura {

constexpr int kMaxThreads = 1024;

/// Returns the number of threads to use; 0 means OpenMP's default. Throws Error outside 0 to kMaxThreads.
int resolve_num_threads(int num_threads);

/// Calls call(body, number) with number 0 in this thread, and with other numbers in up to num_threads - 1 other
/// threads. After this thread's call, waits for the threads that have begun; no others begin. Nested calls run
/// only in this thread.
void run_on_threads(int num_threads, void (*call)(void* body, int number), void* body);

/// Calls body(i), or body(i, thread), for i in [0, count), on at most num_threads threads (0: all). Bodies must not
/// touch each other's outputs.
template <typename Body>
void parallel_for(int num_threads, std::int64_t count, Body&& body) {
  struct Loop {
    void work(int thread) {
      for (std::int64_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) {
        try {
          if constexpr (std::is_invocable_v<Body&, std::int64_t, int>) {
            body(i, thread);
          } else {
            body(i);
          }
        } catch (...) {
          const std::lock_guard lock(mutex);
          if (i < error_item) {
            error = std::current_exception();
            error_item = i;
          }
        }
      }
    }

    Body& body;
    std::int64_t count;
    std::atomic<std::int64_t> next = 0;
    std::mutex mutex{};  // guards the members below
    std::exception_ptr error{};
    std::int64_t error_item = std::numeric_limits<std::int64_t>::max();
  };
  const auto threads = std::min<std::int64_t>(resolve_num_threads(num_threads), count);
  Loop loop{body, count};
  run_on_threads(
      static_cast<int>(threads), [](void* its, int thread) { static_cast<Loop*>(its)->work(thread); }, &loop);
  if (loop.error) std::rethrow_exception(loop.error);
}

}  // namespace pictura
