// Interoperability with CUDA: scenes are read from device memory, and images are copied there without a copy on the
// host. This header uses no CUDA types.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/renderer.h"

namespace pictura::gl {

/// A copy of rows of bytes from a buffer to memory.
struct RowCopy {
  std::size_t from = 0, from_pitch = 0;  // offset in the buffer, and distance between rows
  std::byte* to = nullptr;
  std::size_t to_pitch = 0;
  std::size_t row_bytes = 0, rows = 0;
};

/// A buffer object that CUDA may read.
class CudaBuffer {
 public:
  virtual ~CudaBuffer() = default;
  /// Enqueues copies to device memory on the stream, after all earlier and before all later OpenGL commands. The
  /// buffer's context must be current.
  virtual void copy(Span<const RowCopy> copies, Stream stream) = 0;
};

/// A host copy of a scene.
struct HostScene {
  std::vector<int32_t> world_begin, light_begin, hidden_agents;
  std::vector<AgentBox> agents;
  std::vector<GeometryHandle> geometry;
  std::vector<LightState> light_states;
  std::vector<View> views;
  std::vector<int32_t> num_views;  // [1], or empty if all views are drawn
  ViewBatch view_batch() const { return {views, num_views.empty() ? nullptr : num_views.data()}; }
  SceneBatch batch() const {
    return {Device{}, world_begin, agents, geometry, light_begin, light_states, hidden_agents};
  }
};

class CudaInterop {
 public:
  virtual ~CudaInterop() = default;
  /// No function of this class needs the device to be current.
  virtual Device device() const = 0;
  virtual void synchronize(Stream stream) const = 0;
  /// Registers a buffer object of the current context.
  virtual std::unique_ptr<CudaBuffer> share(unsigned int buffer) const = 0;
  /// Waits for the stream first.
  virtual void copy_to_host(const SceneBatch& scene, const ViewBatch& views, Stream stream,
                            HostScene* scene_out) const = 0;
};

/// Throws Error if the device cannot be used. Defined only in builds with CUDA.
std::unique_ptr<CudaInterop> make_cuda_interop(Device device);

}  // namespace pictura::gl
