// PICTURA_HD marks functions for host and device. NVRTC has no standard library, so this header also declares
// fixed-width integers. Compiler-dependent code belongs in this folder.
#pragma once

#if defined(__CUDACC__)
#define PICTURA_HD __host__ __device__
#else
#define PICTURA_HD
#endif
// Prevents unrolling, because unrolled kernels exceed the instruction cache.
#if defined(__CUDA_ARCH__)
#define PICTURA_NO_UNROLL _Pragma("unroll 1")
#else
#define PICTURA_NO_UNROLL
#endif
// Unrolls a loop over a face's corners by four, the usual number, so that corners stay in registers.
#if defined(__CUDA_ARCH__)
#define PICTURA_UNROLL_FOUR _Pragma("unroll 4")
#else
#define PICTURA_UNROLL_FOUR
#endif

#if defined(__CUDACC_RTC__)
namespace pictura {
using uint8_t = unsigned char;
using int16_t = short;
using int32_t = int;
using uint16_t = unsigned short;
using uint32_t = unsigned int;
using int64_t = long long;
using uint64_t = unsigned long long;
using size_t = unsigned long;
using uintptr_t = unsigned long;
}  // namespace pictura
#else
#include <cmath>
#include <cstddef>
#include <cstdint>
namespace pictura {
using std::int16_t;
using std::int32_t;
using std::int64_t;
using std::size_t;
using std::uint16_t;
using std::uint32_t;
using std::uint64_t;
using std::uint8_t;
using std::uintptr_t;
}  // namespace pictura
#endif
