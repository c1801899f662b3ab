// Device of the network, and access to pictura's memory as torch tensors. Work is enqueued on torch's current stream.
// By default this is CUDA's legacy stream, a null Stream. CUDA graphs cannot capture the legacy stream, so updates with
// graphs use an OwnStream.
#pragma once

#include <functional>

#include <ATen/ATen.h>

#include "pictura/policy/learning_device.h"

namespace pictura {

at::Device torch_device(Device device);

/// Stream of a device that does not wait for other streams implicitly.
class OwnStream {
 public:
  explicit OwnStream(Device device);
  /// Runs `work` with this stream as torch's current stream, after all work on the stream that was current before, and
  /// waits until the work is complete.
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

/// Returns the memory available to the network: on a device the free memory after torch has released its cache; on the
/// host all memory.
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
  // for_blob() takes no pointer to const. It is given the location, so that it need not query the driver.
  return at::for_blob(const_cast<Element*>(array.data()), shape)
      .options(at::TensorOptions(c10::CppTypeToScalarType<StoredAs<Element>>::value).device(where))
      .target_device(where)
      .make_tensor();
}

}  // namespace pictura
