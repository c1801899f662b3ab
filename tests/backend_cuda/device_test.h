// The fixture of tests that need a CUDA device, and helpers that capture CUDA graphs. Without a device, tests are
// skipped, or fail if PICTURA_REQUIRE_GPU is 1.
#pragma once

#include <cstdlib>
#include <functional>
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

/// A stream that does not wait for other streams.
struct OwnStream {
  cudaStream_t stream = nullptr;
  OwnStream() { PICTURA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking)); }
  ~OwnStream() { cudaStreamDestroy(stream); }
  OwnStream(const OwnStream&) = delete;
  OwnStream& operator=(const OwnStream&) = delete;
};

/// A CUDA graph of the work that `work` enqueues.
struct CapturedGraph {
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  CapturedGraph(cudaStream_t stream, const std::function<void()>& work) {
    PICTURA_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
    EXPECT_NO_THROW(work());
    PICTURA_CUDA(cudaStreamEndCapture(stream, &graph));
    PICTURA_CUDA(cudaGraphInstantiate(&executable, graph, 0));
  }
  ~CapturedGraph() {
    cudaGraphExecDestroy(executable);
    cudaGraphDestroy(graph);
  }
  CapturedGraph(const CapturedGraph&) = delete;
  CapturedGraph& operator=(const CapturedGraph&) = delete;
};

/// Forbids allocations and device-wide waits of the calling thread, by an active capture.
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
