// Copies arrays of structs between the host and the network's device. Torch has no structs, so bytes are copied.
#pragma once

#include <type_traits>
#include <vector>

#include "pictura/policy/torch_device.h"

namespace pictura {

/// A copy on the host of an array in the memory of `device`.
template <typename T>
std::vector<T> host_copy_of_structs(Span<const T> array, Device device) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<T> copy(array.size());
  const auto num_bytes = static_cast<int64_t>(array.size() * sizeof(T));
  if (num_bytes == 0) return copy;
  const Span<const uint8_t> from(reinterpret_cast<const uint8_t*>(array.data()), static_cast<size_t>(num_bytes));
  const Span<uint8_t> to(reinterpret_cast<uint8_t*>(copy.data()), static_cast<size_t>(num_bytes));
  tensor_over(to, Device{}, {num_bytes}).copy_(tensor_over(from, device, {num_bytes}));
  return copy;
}

/// Copy of host values in the memory of `device`. The host values may be freed afterwards.
template <typename T>
class DeviceCopy {
 public:
  DeviceCopy(const std::vector<T>& values, Device device) : size_(values.size()) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto num_bytes = static_cast<int64_t>(size_ * sizeof(T));
    const Span<const uint8_t> from(reinterpret_cast<const uint8_t*>(values.data()), static_cast<size_t>(num_bytes));
    bytes_ = at::empty({num_bytes}, at::TensorOptions(at::kByte).device(torch_device(device)));
    if (num_bytes > 0) bytes_.copy_(tensor_over(from, Device{}, {num_bytes}));
  }
  Span<const T> span() const { return {reinterpret_cast<const T*>(bytes_.data_ptr<uint8_t>()), size_}; }
  Span<T> span() { return {reinterpret_cast<T*>(bytes_.data_ptr<uint8_t>()), size_}; }

 private:
  size_t size_;
  at::Tensor bytes_;
};

}  // namespace pictura
