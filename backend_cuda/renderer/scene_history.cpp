// Scene histories in device memory.
#include "pictura/common/scene_history.h"

#include <memory>

#include "pictura/backend_cuda/renderer/scene_history_kernels.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"

namespace pictura {

std::unique_ptr<SceneHistory> make_cuda_scene_history(const SceneHistorySize& size, Device device);

namespace {

class CudaSceneHistory final : public SceneHistory {
 public:
  /// Constructs the history on the current device.
  explicit CudaSceneHistory(const SceneHistorySize& s) : SceneHistory(s), device_(current_device()), arrays_(s) {}

  Device device() const override { return device_; }
  SceneBatch scene() const override { return arrays_.scene(device_, num_steps()); }

 private:
  void copy_step(int step, const SceneBatch& scene, Span<const View> views, Stream stream) override {
    const DeviceGuard guard(device_);
    const auto on_stream = static_cast<cudaStream_t>(stream.handle);
    const auto copy = [on_stream](const auto& from, auto* first) {
      if (from.empty()) return;
      PICTURA_CUDA(
          cudaMemcpyAsync(first, from.data(), from.size() * sizeof(*first), cudaMemcpyDeviceToDevice, on_stream));
    };
    const auto shift = [on_stream](Span<const int32_t> from, int32_t added, int32_t* first) {
      cuda::launch_shift(from, added, first, on_stream);
      PICTURA_CUDA(cudaGetLastError());
    };
    arrays_.write_step(step, scene, views, copy, shift);
  }

  void copy_views(Span<const int64_t> rows, Span<View> views_out, Stream stream) const override {
    const DeviceGuard guard(device_);
    cuda::launch_gather(history_views(arrays_.views.data()), rows, views_out.data(),
                        static_cast<cudaStream_t>(stream.handle));
    PICTURA_CUDA(cudaGetLastError());
  }

  Device device_;
  SceneHistoryArrays<DeviceBuffer> arrays_;
};

}  // namespace

std::unique_ptr<SceneHistory> make_cuda_scene_history(const SceneHistorySize& size, Device device) {
  const DeviceGuard guard(device);
  return std::make_unique<CudaSceneHistory>(size);
}

}  // namespace pictura
