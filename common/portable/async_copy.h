// Asynchronous copies to shared memory, prefetches, and launches that overlap. On the host copies are made at once.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Copies 8 bytes, aligned to as many, into a block's shared memory. A device goes on meanwhile: they are there once
/// the same thread has waited for its copies.
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

/// Asks for the memory around an address, which is read soon.
PICTURA_HD inline void prefetch([[maybe_unused]] const void* address) {
#if defined(__CUDA_ARCH__)
  asm volatile("prefetch.global.L2 [%0];" : : "l"(address));
#endif
}

/// A launch may begin before the one before it on its stream has ended. Waits for that, and for all that it wrote.
PICTURA_HD inline void wait_for_earlier_launch() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  asm volatile("griddepcontrol.wait;" : : : "memory");
#endif
}

}  // namespace pictura
