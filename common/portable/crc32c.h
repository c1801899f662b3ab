// The processor's CRC-32C instruction (SSE 4.2), if available.
#pragma once

#include "pictura/common/portable/hd.h"

#ifdef __SSE4_2__
#include <nmmintrin.h>
#endif

namespace pictura {

#ifdef __SSE4_2__
constexpr bool kHasCrc32cInstruction = true;
/// Extends a running checksum by eight bytes, in little-endian order.
inline uint32_t crc32c_of_word(uint32_t crc, uint64_t word) { return static_cast<uint32_t>(_mm_crc32_u64(crc, word)); }
#else
constexpr bool kHasCrc32cInstruction = false;
PICTURA_HD inline uint32_t crc32c_of_word(uint32_t crc, uint64_t /*word*/) { return crc; }
#endif

}  // namespace pictura
