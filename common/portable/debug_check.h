// PICTURA_DEBUG_CHECK(condition) terminates a debug build if an invariant fails, also in kernels.
#pragma once

#if defined(NDEBUG) || defined(__CUDACC_RTC__)
#define PICTURA_DEBUG_CHECK(condition) static_cast<void>(0)
#else
#include <cassert>
#define PICTURA_DEBUG_CHECK(condition) assert(condition)
#endif
