// Device arithmetic whose rounding the compiler does not guarantee.
#include "pictura/common/cuda/check.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/backend_cuda/renderer/device_arithmetic.h"

namespace pictura::test {
namespace {

using CudaArithmeticTest = DeviceTest;

TEST_F(CudaArithmeticTest, InversesAndRootsAreRoundedToNearest) {
  DeviceBuffer<unsigned long long> counts(2);
  counts.fill(0);
  PICTURA_CUDA(count_unlike_ieee(counts.data(), counts.data() + 1));
  unsigned long long unlike[2];
  counts.copy_to_host(unlike);
  EXPECT_EQ(unlike[0], 0u) << "inverses";
  EXPECT_EQ(unlike[1], 0u) << "roots";
}

}  // namespace
}  // namespace pictura::test
