// Devices and streams of torch, and arrays as tensors. Torch's default stream is CUDA's legacy stream (a null Stream),
// which CUDA graphs cannot capture.
#pragma once

#include <functional>
#include <optional>

#include <ATen/ATen.h>

#include "pictura/policy/learning_device.h"

namespace pictura {

at::Device torch_device(Device device);
/// Returns a stream of any library as torch's, for stream guards; none on the host.
std::optional<c10::Stream> torch_stream(Stream stream, Device device);

/// Stream that graphs can capture, because it does not implicitly wait for other streams.
class OwnStream {
 public:
  explicit OwnStream(Device device);
  /// Runs `work` with this stream as torch's current stream, after all work on the previous stream. Waits until the
  /// work is complete.
  void run(const std::function<void()>& work) const;

 private:
  c10::Stream stream_;
};

/// Frees the device memory that torch caches, and resets DeviceMemory::peak_tensor_bytes. Does nothing on the host.
void release_unused_memory(Device device);

/// Memory use of a CUDA device by all processes, and peak memory of tensors; 0 on the host.
struct DeviceMemory {
  int64_t used_bytes = 0, peak_tensor_bytes = 0;
};
DeviceMemory memory_of(Device device);

/// Frees torch's cache, and returns the device's free memory, or all memory of the host.
int64_t available_bytes(Device device);

/// Returns a contiguous tensor's elements. Throws Error if they are not of type T.
template <typename T>
Span<T> span_of(const at::Tensor& tensor) {
  return {tensor.data_ptr<std::remove_const_t<T>>(), static_cast<size_t>(tensor.numel())};
}
/// Returns a tensor in the memory of an array; it must not be written if the array is read-only.
template <typename T>
at::Tensor tensor_over(Span<T> array, Device device, at::IntArrayRef shape) {
  using Element = std::remove_const_t<T>;
  const at::Device where = torch_device(device);
  // for_blob() takes no pointer to const. target_device() avoids a query of the driver.
  return at::for_blob(const_cast<Element*>(array.data()), shape)
      .options(at::TensorOptions(c10::CppTypeToScalarType<StoredAs<Element>>::value).device(where))
      .target_device(where)
      .make_tensor();
}

}  // namespace pictura
