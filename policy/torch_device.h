// Devices and streams of torch, and access to pictura's arrays as torch tensors. Torch enqueues work on its current
// stream. By default, this is CUDA's legacy stream (a null Stream). CUDA graphs cannot capture the legacy stream, so
// updates with graphs use an OwnStream.
#pragma once

#include <functional>

#include <ATen/ATen.h>

#include "pictura/policy/learning_device.h"

namespace pictura {

at::Device torch_device(Device device);

/// Stream of a device that does not implicitly wait for other streams.
class OwnStream {
 public:
  explicit OwnStream(Device device);
  /// Runs `work` with this stream as torch's current stream, and waits until it is complete. The work starts after all
  /// work on the previously current stream.
  void run(const std::function<void()>& work) const;

 private:
  c10::Stream stream_;
};

/// Frees the device memory that torch caches for later tensors, so that renderers can use it, and resets
/// DeviceMemory::peak_tensor_bytes. Does nothing on the host.
void release_unused_memory(Device device);

/// Memory use of a CUDA device: bytes used by all processes, and peak bytes of torch's tensors. Both are 0 on the host.
struct DeviceMemory {
  int64_t used_bytes = 0, peak_tensor_bytes = 0;
};
DeviceMemory memory_of(Device device);

/// Returns the memory available to the network: on a device, the free memory after release of torch's cache; on the
/// host, all memory.
int64_t available_bytes(Device device);

/// Returns the elements of a contiguous tensor. Throws Error if the tensor has another type.
template <typename T>
Span<T> span_of(const at::Tensor& tensor) {
  return {tensor.data_ptr<std::remove_const_t<T>>(), static_cast<size_t>(tensor.numel())};
}
/// Returns a tensor in the memory of an array. The tensor must not be written if the array is read-only.
template <typename T>
at::Tensor tensor_over(Span<T> array, Device device, at::IntArrayRef shape) {
  using Element = std::remove_const_t<T>;
  const at::Device where = torch_device(device);
  // for_blob() takes no pointer to const. The target device is passed so that torch need not ask the driver for it.
  return at::for_blob(const_cast<Element*>(array.data()), shape)
      .options(at::TensorOptions(c10::CppTypeToScalarType<StoredAs<Element>>::value).device(where))
      .target_device(where)
      .make_tensor();
}

}  // namespace pictura
