// What common/portable/hd.h computes by instructions of a device, counted against that device's own IEEE arithmetic.
#pragma once

#include <cuda_runtime_api.h>

namespace pictura::test {

/// Adds to *inverses and *roots (device memory) for how many numbers, of all mantissas at exponents -100 to 99,
/// reciprocal_in_range (of both signs) and sqrt_in_range are not rounded to nearest.
cudaError_t count_unlike_ieee(unsigned long long* inverses, unsigned long long* roots);

}  // namespace pictura::test
