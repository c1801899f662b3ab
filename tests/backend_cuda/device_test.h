// The fixture of tests that need a CUDA device. Without one they are skipped, unless PICTURA_REQUIRE_GPU=1 says that
// there must be one.
#pragma once

#include <cstdlib>
#include <string>

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include "pictura/common/cuda/check.h"

namespace pictura {

std::string cuda_unavailable();

namespace test {

class DeviceTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string why = cuda_unavailable();
    if (why.empty()) return;
    const char* required = std::getenv("PICTURA_REQUIRE_GPU");
    if (required && std::string(required) == "1") FAIL() << "PICTURA_REQUIRE_GPU=1, but " << why;
    GTEST_SKIP() << "no CUDA device: " << why;
  }
};

/// While it lives, allocations and device-wide waits of this thread are errors: CUDA forbids them during a capture.
class ForbidAllocations {
 public:
  ForbidAllocations() {
    PICTURA_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
    PICTURA_CUDA(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal));
  }
  ~ForbidAllocations() {
    cudaGraph_t nothing = nullptr;
    cudaStreamEndCapture(stream_, &nothing);
    cudaGraphDestroy(nothing);
    cudaStreamDestroy(stream_);
  }
  ForbidAllocations(const ForbidAllocations&) = delete;
  ForbidAllocations& operator=(const ForbidAllocations&) = delete;

 private:
  cudaStream_t stream_ = nullptr;
};

}  // namespace test
}  // namespace pictura
