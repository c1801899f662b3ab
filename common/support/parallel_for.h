// Parallel loops of host code: OpenMP with an explicit number of threads. An exception in a body is rethrown in the
// caller; if several bodies throw, that of the lowest item.
#pragma once

#include <cstdint>
#include <exception>
#include <limits>

#include <omp.h>

namespace pictura {

/// The number of threads to use; 0 means OpenMP's default.
inline int resolve_num_threads(int num_threads) { return num_threads > 0 ? num_threads : omp_get_max_threads(); }

/// Calls body(i) for i in [0, count), over num_threads threads (0: all). Bodies must not touch each other's outputs.
template <typename Body>
void parallel_for(int num_threads, std::int64_t count, Body&& body) {
  std::exception_ptr error;
  std::int64_t error_item = std::numeric_limits<std::int64_t>::max();
#pragma omp parallel for schedule(dynamic, 1) num_threads(resolve_num_threads(num_threads)) if (num_threads != 1)
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
