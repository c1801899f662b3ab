// PICTURA_DEBUG_CHECK(condition) terminates a program of a debug build if an internal invariant fails, on the host and
// in kernels. Other builds do not evaluate the condition.
#pragma once

#if defined(NDEBUG) || defined(__CUDACC_RTC__)
#define PICTURA_DEBUG_CHECK(condition) static_cast<void>(0)
#else
#include <cassert>
#define PICTURA_DEBUG_CHECK(condition) assert(condition)
#endif
