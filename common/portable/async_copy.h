// Asynchronous copies to shared memory, prefetches, and overlapping launches. The host copies immediately.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Copies 8 aligned bytes into a block's shared memory. They are valid after the same thread calls wait_for_copies().
PICTURA_HD inline void copy_into_shared(void* to, const void* from) {
#if defined(__CUDA_ARCH__)
  asm volatile("cp.async.ca.shared.global [%0], [%1], 8;"
               :
               : "r"(static_cast<uint32_t>(__cvta_generic_to_shared(to))), "l"(from)
               : "memory");
#else
  __builtin_memcpy(to, from, 8);
#endif
}
PICTURA_HD inline void wait_for_copies() {
#if defined(__CUDA_ARCH__)
  asm volatile("cp.async.wait_all;" : : : "memory");
#endif
}

/// Prefetches into the L2 cache of a CUDA device or the L1 cache of a host core. The address need not be allocated.
PICTURA_HD inline void prefetch(const void* first, int offset_bytes = 0) {
  // Integers, because a pointer sum must stay within an array.
  const uintptr_t address = reinterpret_cast<uintptr_t>(first) + static_cast<uintptr_t>(offset_bytes);
#if defined(__CUDA_ARCH__)
  asm volatile("prefetch.global.L2 [%0];" : : "l"(address));
#else
  __builtin_prefetch(reinterpret_cast<const void*>(address));
  asm volatile("");  // otherwise g++ drops calls of functions that only prefetch
#endif
}

/// Waits for the previous launch on the stream and its writes, as programmatic dependent launch requires.
PICTURA_HD inline void wait_for_earlier_launch() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  asm volatile("griddepcontrol.wait;" : : : "memory");
#endif
}

}  // namespace pictura
