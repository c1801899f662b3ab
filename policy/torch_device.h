// Device of the network, and pictura's memory as torch tensors. Work is enqueued on torch's current stream: by default
// CUDA's legacy stream, a null Stream. CUDA graphs cannot capture that stream, so updates with graphs use a stream of
// their own.
#pragma once

#include <functional>

#include <ATen/ATen.h>

#include "pictura/common/array.h"
#include "pictura/configuration/config.h"

namespace pictura {

/// Device on which this configuration learns, in the process with this local rank. If the configuration leaves the
/// device open and there are several, the rank selects it. Opens torch's CUDA library for a CUDA device. Throws Error
/// naming the key and the reason if the configuration cannot learn there, or if the simulator or the renderer uses
/// other memory.
Device open_learning_device(const Config& config, int local_rank = 0);

at::Device torch_device(Device device);

/// Torch's current stream of a device, on which tensors are computed. Autograd enqueues the backward pass on it too.
Stream current_stream(Device device);

/// Stream of a device that waits for no other stream.
class OwnStream {
 public:
  explicit OwnStream(Device device);
  /// Runs `work` with this stream as torch's current stream, after all work on the previous current stream, and waits
  /// for it.
  void run(const std::function<void()>& work) const;

 private:
  c10::Stream stream_;
};

/// Releases the device memory that torch caches for later tensors, so that renderers can use it, and resets the peak of
/// DeviceMemory. Does nothing on the host.
void release_unused_memory(Device device);

/// Memory use of a CUDA device: bytes in use by all processes, and peak bytes of tensors. 0 on the host.
struct DeviceMemory {
  int64_t used_bytes = 0, peak_tensor_bytes = 0;
};
DeviceMemory memory_of(Device device);

/// Bytes available there: on a device the free memory after torch has released its cache; on the host all memory.
int64_t available_bytes(Device device);

/// Elements of a contiguous tensor. Throws Error if its type differs.
template <typename T>
Span<T> span_of(const at::Tensor& tensor) {
  return {tensor.data_ptr<std::remove_const_t<T>>(), static_cast<size_t>(tensor.numel())};
}
/// Tensor over the memory of an array. The tensor must not be written if the array is read-only.
template <typename T>
at::Tensor tensor_over(Span<T> array, Device device, at::IntArrayRef shape) {
  using Element = std::remove_const_t<T>;
  const at::Device where = torch_device(device);
  // for_blob takes no pointer to const. With the location given, it does not query the driver.
  return at::for_blob(const_cast<Element*>(array.data()), shape)
      .options(at::TensorOptions(c10::CppTypeToScalarType<StoredAs<Element>>::value).device(where))
      .target_device(where)
      .make_tensor();
}

/// Returns a host copy of an array in the memory of `device`.
template <typename T>
std::vector<T> host_copy(Span<const T> array, Device device) {
  std::vector<T> copy(array.size());
  const auto size = static_cast<int64_t>(array.size());
  tensor_over(Span<T>(copy), Device{}, {size}).copy_(tensor_over(array, device, {size}));
  return copy;
}

}  // namespace pictura
