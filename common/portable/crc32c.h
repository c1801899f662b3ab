// The processor's instruction for CRC-32C, where the compiler may use it (SSE 4.2, which x86-64-v3 includes).
#pragma once

#include <cstdint>

#ifdef __SSE4_2__
#include <nmmintrin.h>
#endif

namespace pictura {

#ifdef __SSE4_2__
constexpr bool kHasCrc32cInstruction = true;
/// The running sum after eight bytes more, in little-endian order.
inline std::uint32_t crc32c_of_word(std::uint32_t crc, std::uint64_t word) {
  return static_cast<std::uint32_t>(_mm_crc32_u64(crc, word));
}
#else
constexpr bool kHasCrc32cInstruction = false;
inline std::uint32_t crc32c_of_word(std::uint32_t crc, std::uint64_t) { return crc; }
#endif

}  // namespace pictura
