// Comparison of common/portable/intrinsics.h on the device with IEEE arithmetic.
#pragma once

#include <cuda_runtime_api.h>

namespace pictura::test {

/// Counts, in device memory, the values that reciprocal_in_range() or sqrt_in_range() does not round to nearest. Tests
/// all mantissas and exponents -100 to 99, for reciprocals with both signs.
cudaError_t count_unlike_ieee(unsigned long long* inverses, unsigned long long* roots);

}  // namespace pictura::test
