// Device of a network, and arrays in its memory. Has no torch headers: torch_device.cpp implements these functions with
// torch, and host_device.cpp for builds without torch, which compute on the host.
#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the device on which this configuration learns, in the process with this local rank. If the configuration
/// does not specify one of several devices, the rank selects it. Opens torch's CUDA library for a CUDA device. Throws
/// Error naming the key and the reason if the configuration cannot learn on this device, or if the simulator or the
/// renderer uses other memory.
Device open_learning_device(const Config& config, int local_rank = 0);

/// Torch's current stream of a device, on which the network computes; null on the host. Autograd enqueues the backward
/// pass on it too.
Stream current_stream(Device device);

/// Returns uninitialised memory of a device, which is freed with the pointer.
std::shared_ptr<std::byte> allocate_bytes(size_t bytes, Device device);
void set_to_zero(std::byte* memory, size_t bytes, Device device);
/// Copies on the current stream. A copy to the host is complete on return; a copy from the host has read its source,
/// which may then be freed.
void copy_bytes(std::byte* to, Device to_device, const std::byte* from, Device from_device, size_t bytes);

/// Array in the memory of a device.
template <typename T>
class DeviceArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Allocates `size` uninitialised elements.
  DeviceArray(size_t size, Device device) : size_(size), memory_(allocate_bytes(size * sizeof(T), device)) {}
  Span<const T> span() const { return {data(), size_}; }
  Span<T> span() { return {data(), size_}; }

 protected:
  T* data() const { return reinterpret_cast<T*>(memory_.get()); }

 private:
  size_t size_;
  std::shared_ptr<std::byte> memory_;
};

/// Copy of host values in the memory of `device`. The host values may be freed afterwards.
template <typename T>
class DeviceCopy : public DeviceArray<T> {
 public:
  DeviceCopy(const std::vector<T>& values, Device device) : DeviceArray<T>(values.size(), device) {
    copy_bytes(reinterpret_cast<std::byte*>(this->data()), device, reinterpret_cast<const std::byte*>(values.data()),
               Device{}, values.size() * sizeof(T));
  }
};

/// Returns a host copy of an array in the memory of `device`.
template <typename T>
std::vector<std::remove_const_t<T>> host_copy(Span<T> array, Device device) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<std::remove_const_t<T>> copy(array.size());
  copy_bytes(reinterpret_cast<std::byte*>(copy.data()), Device{}, reinterpret_cast<const std::byte*>(array.data()),
             device, array.size() * sizeof(T));
  return copy;
}

}  // namespace pictura
