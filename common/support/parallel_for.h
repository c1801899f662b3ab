// Parallel loops of host code: OpenMP with an explicit number of threads. An exception in a body is rethrown in the
// caller; if several bodies throw, that of the lowest item.
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <limits>

#include <omp.h>

#include "pictura/common/error.h"

namespace pictura {

/// Far above what a host has, and below where OpenMP ends the process because the system has no more threads.
constexpr int kMaxThreads = 1024;

/// The number of threads to use; 0 means OpenMP's default, cut off at kMaxThreads. Throws Error for numbers out of 0 to
/// kMaxThreads.
inline int resolve_num_threads(int num_threads) {
  PICTURA_CHECK(num_threads >= 0 && num_threads <= kMaxThreads, "threads: expected 0 (all) to {}, got {}", kMaxThreads,
                num_threads);
  return num_threads > 0 ? num_threads : std::min(omp_get_max_threads(), kMaxThreads);
}

/// Calls body(i) for i in [0, count), over num_threads threads (0: all). Bodies must not touch each other's outputs.
template <typename Body>
void parallel_for(int num_threads, std::int64_t count, Body&& body) {
  const int resolved = resolve_num_threads(num_threads);
  std::exception_ptr error;
  std::int64_t error_item = std::numeric_limits<std::int64_t>::max();
#pragma omp parallel for schedule(dynamic, 1) num_threads(resolved) if (resolved != 1)
  for (std::int64_t i = 0; i < count; ++i) {
    try {
      body(i);
    } catch (...) {
#pragma omp critical(pictura_parallel_for_error)
      if (i < error_item) {
        error = std::current_exception();
        error_item = i;
      }
    }
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace pictura
