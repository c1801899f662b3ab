#include "pictura/common/portable/hd.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/tests/backend_cuda/renderer/device_arithmetic.h"

namespace pictura::test {

namespace {

constexpr unsigned kExponents = 200, kLowestExponent = 127 - 100, kMantissaBits = 23;

__global__ void count_unlike(unsigned long long* inverses, unsigned long long* roots) {
  const unsigned exponent = kLowestExponent + blockIdx.y;
  for (unsigned mantissa = blockIdx.x * blockDim.x + threadIdx.x; mantissa < 1u << kMantissaBits;
       mantissa += gridDim.x * blockDim.x) {
    const float x = __uint_as_float(exponent << kMantissaBits | mantissa);
    if (bits_from_float(reciprocal_in_range(x)) != bits_from_float(__frcp_rn(x))) atomicAdd(inverses, 1ull);
    if (bits_from_float(reciprocal_in_range(-x)) != bits_from_float(__frcp_rn(-x))) atomicAdd(inverses, 1ull);
    if (bits_from_float(sqrt_in_range(x)) != bits_from_float(__fsqrt_rn(x))) atomicAdd(roots, 1ull);
  }
}

}  // namespace

cudaError_t count_unlike_ieee(unsigned long long* inverses, unsigned long long* roots) {
  count_unlike<<<dim3(256, kExponents), 256>>>(inverses, roots);
  return cudaGetLastError();
}

}  // namespace pictura::test
