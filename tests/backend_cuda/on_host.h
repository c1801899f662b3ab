// Copies of device memory for tests.
#pragma once

#include <type_traits>
#include <vector>

#include "pictura/common/cuda/check.h"
#include "pictura/common/span.h"
#include "pictura/tests/simulator/same_bits.h"

namespace pictura::test {

/// Waits for the device.
template <typename T>
std::vector<std::remove_const_t<T>> on_host(Span<T> device) {
  std::vector<std::remove_const_t<T>> host(device.size());
  PICTURA_CUDA(cudaDeviceSynchronize());
  if (!host.empty()) {
    PICTURA_CUDA(cudaMemcpy(host.data(), device.data(), host.size() * sizeof(T), cudaMemcpyDeviceToHost));
  }
  return host;
}

template <typename T>
bool same(Span<T> host, Span<T> device) {
  const auto copy = on_host(device);
  return pictura::testing::same_bits(Span<const T>(host), Span<const T>(copy));
}

}  // namespace pictura::test
