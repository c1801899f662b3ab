// Comparison of the device code in common/portable/intrinsics.h with the device's IEEE arithmetic.
#pragma once

#include <cuda_runtime_api.h>

namespace pictura::test {

/// Counts the values for which reciprocal_in_range() or sqrt_in_range() does not round to nearest. Adds the counts to
/// *inverses and *roots in device memory. The values have all mantissas and exponents -100 to 99; for reciprocals, they
/// have both signs.
cudaError_t count_unlike_ieee(unsigned long long* inverses, unsigned long long* roots);

}  // namespace pictura::test
