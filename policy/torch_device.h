// Where the network computes, and pictura's memory as torch's tensors. Work is put on torch's current stream: by
// default CUDA's legacy one, a null Stream; in updates with graphs, which it cannot capture, one of their own.
#pragma once

#include <functional>

#include <ATen/ATen.h>

#include "pictura/common/array.h"
#include "pictura/configuration/config.h"

namespace pictura {

/// Where this configuration learns, in the process of this number on its host: on the device of that number, where the
/// configuration leaves it open and there is more than one. Opens torch's CUDA library if that is a CUDA device. Throws
/// Error naming the key and the reason where it cannot learn there, or where the simulator or the renderer works in
/// other memory.
Device open_learning_device(const Config& config, int local_rank = 0);

at::Device torch_device(Device device);

/// Torch's current stream of a device, on which tensors are computed; autograd puts the backward pass on it too.
Stream current_stream(Device device);

/// A stream of a device that waits for no other.
class OwnStream {
 public:
  explicit OwnStream(Device device);
  /// Does some work with this as torch's current stream, after all work on the stream that is the current one now, and
  /// waits for it.
  void run(const std::function<void()>& work) const;

 private:
  c10::Stream stream_;
};

/// Gives back what torch keeps of a device's memory for later tensors, so that renderers can have it, and begins a new
/// peak of DeviceMemory. Nothing happens on the host.
void release_unused_memory(Device device);

/// Of a CUDA device: bytes that all processes have in use, and the most that tensors took at once. 0 on the host.
struct DeviceMemory {
  int64_t used_bytes = 0, peak_tensor_bytes = 0;
};
DeviceMemory memory_of(Device device);

/// Bytes that can be had there: of a device, what is free when torch has given back what it caches; of the host, all.
int64_t available_bytes(Device device);

/// The elements of a tensor without gaps. Throws Error where its type is another one.
template <typename T>
Span<T> span_of(const at::Tensor& tensor) {
  return {tensor.data_ptr<std::remove_const_t<T>>(), static_cast<size_t>(tensor.numel())};
}
/// An array as a tensor over the same memory, which must not be written where the array is read-only.
template <typename T>
at::Tensor tensor_over(Span<T> array, Device device, at::IntArrayRef shape) {
  using Element = std::remove_const_t<T>;
  const at::Device where = torch_device(device);
  // for_blob takes no pointer to const. Told where the memory is, it does not ask the driver.
  return at::for_blob(const_cast<Element*>(array.data()), shape)
      .options(at::TensorOptions(c10::CppTypeToScalarType<StoredAs<Element>>::value).device(where))
      .target_device(where)
      .make_tensor();
}

/// A copy of an array in the memory of `device` on the host.
template <typename T>
std::vector<T> host_copy(Span<const T> array, Device device) {
  std::vector<T> copy(array.size());
  const auto size = static_cast<int64_t>(array.size());
  tensor_over(Span<T>(copy), Device{}, {size}).copy_(tensor_over(array, device, {size}));
  return copy;
}

}  // namespace pictura
