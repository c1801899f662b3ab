// Copies of host scenes and images in device memory, kept and reused from call to call.
#pragma once

#include <vector>

#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#include "pictura/common/image.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Device memory that grows to what was last copied into it, and never shrinks.
template <typename T>
class DeviceCopy {
 public:
  /// Copies from the host on the stream; pageable host memory can be overwritten when the call returns.
  Span<const T> assign(Span<const T> host, cudaStream_t stream) {
    if (buffer_.size() < host.size()) buffer_ = DeviceBuffer<T>(host.size());
    if (!host.empty()) {
      PICTURA_CUDA(
          cudaMemcpyAsync(buffer_.data(), host.data(), host.size() * sizeof(T), cudaMemcpyHostToDevice, stream));
    }
    return {buffer_.data(), host.size()};
  }
  /// Room for so many elements, with undefined contents.
  Span<T> resize(std::size_t size) {
    if (buffer_.size() < size) buffer_ = DeviceBuffer<T>(size);
    return {buffer_.data(), size};
  }

 private:
  DeviceBuffer<T> buffer_;
};

/// A host scene's copy.
class DeviceScene {
 public:
  DeviceScene() = default;
  explicit DeviceScene(const SceneBatch& host) { assign(host); }
  const SceneBatch& batch() const { return batch_; }
  const SceneBatch& assign(const SceneBatch& host, cudaStream_t stream = nullptr) {
    batch_ = {current_device(),
              world_begin_.assign(host.world_begin, stream),
              agents_.assign(host.agents, stream),
              geometry_.assign(host.geometry, stream),
              light_begin_.assign(host.light_begin, stream),
              light_states_.assign(host.light_states, stream),
              hidden_agents_.assign(host.hidden_agents, stream)};
    return batch_;
  }

 private:
  SceneBatch batch_;
  DeviceCopy<int32_t> world_begin_, geometry_, light_begin_, hidden_agents_;
  DeviceCopy<AgentBox> agents_;
  DeviceCopy<LightState> light_states_;
};

/// Room on the device for images that lie on the host: colour packed as [views, 3, height, width] for each camera, and
/// the planes that the host has.
class DeviceImages {
 public:
  ImageBatch like(const ImageBatch& host) {
    const auto views = static_cast<std::size_t>(host.num_views);
    staged_.resize(host.cameras.size());
    cameras_.assign(host.cameras.begin(), host.cameras.end());
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      CameraImages& camera = cameras_[k];
      Staged& staged = staged_[k];
      const std::size_t pixels = pixels_of(camera);
      camera.view_stride = static_cast<int64_t>(3 * pixels);
      camera.data = staged.color.resize(3 * pixels * views * bytes_per_value(host.format)).data();
      if (camera.depth_m) camera.depth_m = staged.depth_m.resize(pixels * views).data();
      if (camera.class_id) camera.class_id = staged.class_id.resize(pixels * views).data();
      if (camera.instance_id) camera.instance_id = staged.instance_id.resize(pixels * views).data();
    }
    return {current_device(), host.format, host.num_views, cameras_};
  }

  /// Copies what like(host) made back into the host's images, on the stream.
  void copy_to_host(const ImageBatch& host, cudaStream_t stream = nullptr) const {
    const auto views = static_cast<std::size_t>(host.num_views);
    auto copy = [&](void* to, const void* from, std::size_t bytes) {
      if (bytes > 0) PICTURA_CUDA(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream));
    };
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      const CameraImages &to = host.cameras[k], &from = cameras_[k];
      const std::size_t pixels = pixels_of(to), value_bytes = bytes_per_value(host.format);
      const std::size_t image_bytes = 3 * pixels * value_bytes;
      const std::size_t stride_bytes = static_cast<std::size_t>(to.view_stride) * value_bytes;
      if (views > 0 && image_bytes > 0) {
        PICTURA_CUDA(cudaMemcpy2DAsync(to.data, views > 1 ? stride_bytes : image_bytes, from.data, image_bytes,
                                       image_bytes, views, cudaMemcpyDeviceToHost, stream));
      }
      if (to.depth_m) copy(to.depth_m, from.depth_m, pixels * views * sizeof(float));
      if (to.class_id) copy(to.class_id, from.class_id, pixels * views);
      if (to.instance_id) copy(to.instance_id, from.instance_id, pixels * views * sizeof(uint16_t));
    }
  }

 private:
  struct Staged {
    DeviceCopy<uint8_t> color, class_id;
    DeviceCopy<float> depth_m;
    DeviceCopy<uint16_t> instance_id;
  };
  static std::size_t pixels_of(const CameraImages& camera) {
    return static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  }
  std::vector<Staged> staged_;
  std::vector<CameraImages> cameras_;
};

}  // namespace pictura
