// Device copies of host scenes, and images in device memory.
#pragma once

#include <vector>

#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#include "pictura/common/image.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Device memory that grows to the largest array so far and never shrinks.
template <typename T>
class DeviceUpload {
 public:
  /// Copies from the host on the stream. Pageable host memory may be overwritten afterwards.
  Span<const T> assign(Span<const T> host, cudaStream_t stream) {
    if (buffer_.size() < host.size()) buffer_ = DeviceBuffer<T>(host.size());
    if (!host.empty()) {
      PICTURA_CUDA(
          cudaMemcpyAsync(buffer_.data(), host.data(), host.size() * sizeof(T), cudaMemcpyHostToDevice, stream));
    }
    return {buffer_.data(), host.size()};
  }
  /// Resizes the array, whose contents become undefined.
  Span<T> resize(std::size_t size) {
    if (buffer_.size() < size) buffer_ = DeviceBuffer<T>(size);
    return {buffer_.data(), size};
  }

 private:
  DeviceBuffer<T> buffer_;
};

/// Device copy of a host scene.
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
  DeviceUpload<int32_t> world_begin_, geometry_, light_begin_, hidden_agents_;
  DeviceUpload<AgentBox> agents_;
  DeviceUpload<LightState> light_states_;
};

/// Device memory for images that are then copied to the host.
class DeviceImages {
 public:
  /// Allocates images of the same sizes, format and planes as `host`, on the current device.
  ImageBatch like(const ImageBatch& host) {
    std::vector<ImageSize> sizes;
    for (const CameraImages& camera : host.cameras) sizes.push_back({camera.width_px, camera.height_px});
    layout_ = image_layout(sizes, host.num_views, host.format, host.order, host.patch_px);
    const Span<uint8_t> color = color_.resize(layout_.bytes());
    planes_.resize(sizes.size());
    cameras_.assign(host.cameras.begin(), host.cameras.end());
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      CameraImages& camera = cameras_[k];
      const CameraImages placed = camera_images(layout_, static_cast<int>(k), color.data());
      camera.data = placed.data;
      camera.view_stride = placed.view_stride;
      const std::size_t pixels = pixels_of(k, host.num_views);
      if (camera.depth_m) camera.depth_m = planes_[k].depth_m.resize(pixels).data();
      if (camera.class_id) camera.class_id = planes_[k].class_id.resize(pixels).data();
      if (camera.instance_id) camera.instance_id = planes_[k].instance_id.resize(pixels).data();
    }
    color_bytes_ = color;
    return {current_device(), host.format, host.num_views, cameras_, host.order, host.patch_px};
  }

  /// Returns the bytes of all colour images, which like() allocated.
  Span<uint8_t> color_bytes() const { return color_bytes_; }

  /// Copies the images to host images, which may have fewer views, on the stream.
  void copy_to_host(const ImageBatch& host, cudaStream_t stream = nullptr) const {
    const auto views = static_cast<std::size_t>(host.num_views);
    auto copy = [&](void* to, const void* from, std::size_t bytes) {
      if (bytes > 0) PICTURA_CUDA(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream));
    };
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      const CameraImages &to = host.cameras[k], &from = cameras_[k];
      const std::size_t value_bytes = bytes_per_value(host.format), pixels = pixels_of(k, host.num_views);
      const std::size_t image_bytes = static_cast<std::size_t>(layout_.cameras[k].camera_stride) * value_bytes;
      auto pitch = [&](int64_t view_stride) {
        // A single image may have any stride, but CUDA rejects a pitch below the row size.
        return views > 1 ? static_cast<std::size_t>(view_stride) * value_bytes : image_bytes;
      };
      if (views > 0 && image_bytes > 0) {
        PICTURA_CUDA(cudaMemcpy2DAsync(to.data, pitch(to.view_stride), from.data, pitch(from.view_stride), image_bytes,
                                       views, cudaMemcpyDeviceToHost, stream));
      }
      if (to.depth_m) copy(to.depth_m, from.depth_m, pixels * sizeof(float));
      if (to.class_id) copy(to.class_id, from.class_id, pixels);
      if (to.instance_id) copy(to.instance_id, from.instance_id, pixels * sizeof(uint16_t));
    }
  }

 private:
  struct CameraPlanes {
    DeviceUpload<float> depth_m;
    DeviceUpload<uint8_t> class_id;
    DeviceUpload<uint16_t> instance_id;
  };
  std::size_t pixels_of(std::size_t camera, int num_views) const {
    return static_cast<std::size_t>(num_views * layout_.cameras[camera].size.pixels());
  }
  ImageLayout layout_;
  DeviceUpload<uint8_t> color_;
  Span<uint8_t> color_bytes_;
  std::vector<CameraPlanes> planes_;
  std::vector<CameraImages> cameras_;
};

}  // namespace pictura
