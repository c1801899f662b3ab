// Device on which a network computes, and arrays in its memory. Includes no torch headers: torch_device.cpp implements
// these functions with torch; host_device.cpp implements them for builds without torch, which compute on the host.
#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the device on which this configuration learns. If there are several devices and the configuration gives no
/// index, local_rank (the index of the process on this machine) selects the device. Loads torch's CUDA library for a
/// CUDA device. Throws Error if the configuration cannot learn on this device, or if the simulator or the renderer uses
/// other memory. The message contains the setting's key and the reason.
Device open_learning_device(const Config& config, int local_rank = 0);

/// Returns torch's current stream of a device, or null on the host. The network's forward and backward passes are
/// enqueued on this stream.
Stream current_stream(Device device);

/// Allocates uninitialised memory on a device. The memory is freed with the pointer.
std::shared_ptr<std::byte> allocate_bytes(size_t bytes, Device device);
void set_to_zero(std::byte* memory, size_t bytes, Device device);
/// Copies on the current stream. A copy to the host is complete on return. A copy from the host has read its source on
/// return, so the source may be freed.
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

/// Array in the memory of `device` with a copy of host values. The host values may be freed afterwards.
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
