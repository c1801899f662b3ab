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
  /// On the current device.
  explicit CudaSceneHistory(const SceneHistorySize& s)
      : SceneHistory(s),
        device_(current_device()),
        agents_(steps() * s.agents),
        geometry_(steps() * s.worlds),
        light_states_(steps() * s.lights),
        world_begin_(steps() * s.worlds + 1),
        light_begin_(steps() * s.worlds + 1),
        views_(steps() * s.views) {}

  Device device() const override { return device_; }

  SceneBatch scene() const override {
    const auto done = static_cast<std::size_t>(num_steps());
    return {device_,
            {world_begin_.data(), done * size().worlds + 1},
            {agents_.data(), done * size().agents},
            {geometry_.data(), done * size().worlds},
            {light_begin_.data(), done * size().worlds + 1},
            {light_states_.data(), done * size().lights},
            {}};
  }

 private:
  std::size_t steps() const { return static_cast<std::size_t>(size().num_steps); }

  void copy_step(int step, const SceneBatch& scene, Span<const View> views, Stream stream) override {
    const DeviceGuard guard(device_);
    const auto before = static_cast<std::size_t>(step);
    const auto on_stream = static_cast<cudaStream_t>(stream.handle);
    const auto copy = [on_stream](const auto& from, auto* first) {
      if (from.empty()) return;
      PICTURA_CUDA(
          cudaMemcpyAsync(first, from.data(), from.size() * sizeof(*first), cudaMemcpyDeviceToDevice, on_stream));
    };
    const auto copy_ranges = [on_stream](Span<const int32_t> from, std::size_t added, int32_t* first) {
      cuda::launch_shift(from, static_cast<int32_t>(added), first, on_stream);
      PICTURA_CUDA(cudaGetLastError());
    };
    copy(scene.agents, agents_.data() + before * size().agents);
    copy(scene.geometry, geometry_.data() + before * size().worlds);
    copy(scene.light_states, light_states_.data() + before * size().lights);
    copy(views, views_.data() + before * size().views);
    copy_ranges(scene.world_begin, before * size().agents, world_begin_.data() + before * size().worlds);
    copy_ranges(scene.light_begin, before * size().lights, light_begin_.data() + before * size().worlds);
  }

  void copy_views(Span<const int64_t> rows, Span<View> views_out, Stream stream) const override {
    const DeviceGuard guard(device_);
    cuda::launch_gather(history_views(views_.data()), rows, views_out.data(), static_cast<cudaStream_t>(stream.handle));
    PICTURA_CUDA(cudaGetLastError());
  }

  Device device_;
  DeviceBuffer<AgentBox> agents_;
  DeviceBuffer<GeometryHandle> geometry_;
  DeviceBuffer<LightState> light_states_;
  DeviceBuffer<int32_t> world_begin_, light_begin_;
  DeviceBuffer<View> views_;
};

}  // namespace

std::unique_ptr<SceneHistory> make_cuda_scene_history(const SceneHistorySize& size, Device device) {
  const DeviceGuard guard(device);
  return std::make_unique<CudaSceneHistory>(size);
}

}  // namespace pictura
