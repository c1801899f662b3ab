// CUDA graphs of a learner's work.
#include "pictura/training/rules/device_graph.h"

#include <functional>
#include <memory>

#include "pictura/common/cuda/check.h"
#include "pictura/common/cuda/device_guard.h"

namespace pictura {

std::unique_ptr<DeviceGraph> capture_cuda_graph(Device device, Stream stream, const std::function<void()>& work);

namespace {

class CudaGraph final : public DeviceGraph {
 public:
  CudaGraph(Device device, cudaStream_t stream, const std::function<void()>& work) : device_(device) {
    const DeviceGuard guard(device_);
    // Allocations and waits of this thread during the capture are errors. Other threads, such as NCCL's, may allocate
    // and wait.
    PICTURA_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    cudaGraph_t graph = nullptr;
    try {
      work();
    } catch (...) {
      cudaStreamEndCapture(stream, &graph);
      cudaGetLastError();  // the exception of the work is more informative
      if (graph) cudaGraphDestroy(graph);
      throw;
    }
    PICTURA_CUDA(cudaStreamEndCapture(stream, &graph));
    const cudaError_t status = cudaGraphInstantiate(&executable_, graph, 0);
    cudaGraphDestroy(graph);
    PICTURA_CUDA(status);
  }
  ~CudaGraph() override { cudaGraphExecDestroy(executable_); }

  void launch(Stream stream) override {
    const DeviceGuard guard(device_);
    PICTURA_CUDA(cudaGraphLaunch(executable_, static_cast<cudaStream_t>(stream.handle)));
  }

 private:
  const Device device_;
  cudaGraphExec_t executable_ = nullptr;
};

}  // namespace

std::unique_ptr<DeviceGraph> capture_cuda_graph(Device device, Stream stream, const std::function<void()>& work) {
  return std::make_unique<CudaGraph>(device, static_cast<cudaStream_t>(stream.handle), work);
}

}  // namespace pictura
