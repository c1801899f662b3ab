// PICTURA_DEBUG_CHECK(condition): what only a fault of ours makes false ends a debug build, on the host and in kernels;
// other builds do not look.
#pragma once

#if defined(NDEBUG) || defined(__CUDACC_RTC__)
#define PICTURA_DEBUG_CHECK(condition) static_cast<void>(0)
#else
#include <cassert>
#define PICTURA_DEBUG_CHECK(condition) assert(condition)
#endif
