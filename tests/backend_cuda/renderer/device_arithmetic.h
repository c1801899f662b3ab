// Device instructions of common/portable/hd.h, compared with the device's own IEEE arithmetic.
#pragma once

#include <cuda_runtime_api.h>

namespace pictura::test {

/// Adds to *inverses and *roots (device memory) the number of values that reciprocal_in_range (of both signs) and
/// sqrt_in_range do not round to nearest. Values have all mantissas and exponents -100 to 99.
cudaError_t count_unlike_ieee(unsigned long long* inverses, unsigned long long* roots);

}  // namespace pictura::test
