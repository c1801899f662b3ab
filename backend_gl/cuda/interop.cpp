#include "pictura/backend_gl/cuda/interop.h"

#include <cuda_gl_interop.h>
#include <cuda_runtime_api.h>

#include "pictura/common/cuda/device_guard.h"

namespace pictura::gl {

namespace {

class RegisteredBuffer final : public CudaBuffer {
 public:
  RegisteredBuffer(Device device, GLuint buffer) : device_(device) {
    const DeviceGuard guard(device_);
    PICTURA_CUDA(cudaGraphicsGLRegisterBuffer(&resource_, buffer, cudaGraphicsRegisterFlagsReadOnly));
  }
  ~RegisteredBuffer() override {
    int previous = 0;
    const bool is_known = cudaGetDevice(&previous) == cudaSuccess;
    cudaSetDevice(device_.index);
    cudaGraphicsUnregisterResource(resource_);
    if (is_known) cudaSetDevice(previous);
  }

  void copy(Span<const RowCopy> copies, Stream stream) override {
    const DeviceGuard guard(device_);
    const auto queue = static_cast<cudaStream_t>(stream.handle);
    PICTURA_CUDA(cudaGraphicsMapResources(1, &resource_, queue));
    void* mapped = nullptr;
    std::size_t bytes = 0;
    cudaError_t status = cudaGraphicsResourceGetMappedPointer(&mapped, &bytes, resource_);
    for (std::size_t i = 0; i < copies.size() && status == cudaSuccess; ++i) {
      const RowCopy& rows = copies[i];
      status = cudaMemcpy2DAsync(rows.to, rows.to_pitch, static_cast<const std::byte*>(mapped) + rows.from,
                                 rows.from_pitch, rows.row_bytes, rows.rows, cudaMemcpyDeviceToDevice, queue);
    }
    PICTURA_CUDA(cudaGraphicsUnmapResources(1, &resource_, queue));
    check_cuda(status, "copying images to device memory");
  }

 private:
  Device device_;
  cudaGraphicsResource_t resource_ = nullptr;
};

template <typename T>
void download(Span<const T> device, std::vector<T>* host_out, cudaStream_t queue) {
  host_out->resize(device.size());
  if (device.empty()) return;
  PICTURA_CUDA(
      cudaMemcpyAsync(host_out->data(), device.data(), device.size() * sizeof(T), cudaMemcpyDeviceToHost, queue));
}

class RuntimeInterop final : public CudaInterop {
 public:
  explicit RuntimeInterop(Device device) : device_(device) {}
  Device device() const override { return device_; }
  void synchronize(Stream stream) const override {
    const DeviceGuard guard(device_);
    PICTURA_CUDA(cudaStreamSynchronize(static_cast<cudaStream_t>(stream.handle)));
  }
  std::unique_ptr<CudaBuffer> share(unsigned int buffer) const override {
    return std::make_unique<RegisteredBuffer>(device_, buffer);
  }
  void copy_to_host(const SceneBatch& scene, const ViewBatch& views, Stream stream,
                    HostScene* scene_out) const override {
    const DeviceGuard guard(device_);
    const auto queue = static_cast<cudaStream_t>(stream.handle);
    download(scene.world_begin, &scene_out->world_begin, queue);
    download(scene.agents, &scene_out->agents, queue);
    download(scene.geometry, &scene_out->geometry, queue);
    download(scene.light_begin, &scene_out->light_begin, queue);
    download(scene.light_states, &scene_out->light_states, queue);
    download(scene.hidden_agents, &scene_out->hidden_agents, queue);
    download(views.views, &scene_out->views, queue);
    download(Span<const int32_t>(views.num_views, views.num_views ? 1 : 0), &scene_out->num_views, queue);
    PICTURA_CUDA(cudaStreamSynchronize(queue));
  }

 private:
  Device device_;
};

}  // namespace

std::unique_ptr<CudaInterop> make_cuda_interop(Device device) {
  const DeviceGuard guard(device);  // throws if the device does not exist
  return std::make_unique<RuntimeInterop>(device);
}

}  // namespace pictura::gl
