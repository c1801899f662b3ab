// Device of the network, and arrays in its memory. Includes no torch headers; host_device.cpp is for builds without
// torch.
#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the device on which this configuration learns. Without a device index in the configuration, local_rank (the
/// process's index on this machine) selects one. Throws Error naming the key if learning there is impossible, or if
/// simulator or renderer use other memory.
Device open_learning_device(const Config& config, int local_rank = 0);

/// Returns torch's current stream, which the network uses; null on the host.
Stream current_stream(Device device);

/// Allocates uninitialised memory, which the pointer frees.
std::shared_ptr<std::byte> allocate_bytes(size_t bytes, Device device);
void set_to_zero(std::byte* memory, size_t bytes, Device device);
/// Copies on the current stream. On return, a copy to the host is complete, and the source of a copy from the host may
/// be freed.
void copy_bytes(std::byte* to, Device to_device, const std::byte* from, Device from_device, size_t bytes);

/// Array in a device's memory.
template <typename T>
class DeviceArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Allocates uninitialised elements.
  DeviceArray(size_t size, Device device) : size_(size), memory_(allocate_bytes(size * sizeof(T), device)) {}
  Span<const T> span() const { return {data(), size_}; }
  Span<T> span() { return {data(), size_}; }

 protected:
  T* data() const { return reinterpret_cast<T*>(memory_.get()); }

 private:
  size_t size_;
  std::shared_ptr<std::byte> memory_;
};

/// Array with a copy of host values.
template <typename T>
class DeviceCopy : public DeviceArray<T> {
 public:
  DeviceCopy(const std::vector<T>& values, Device device) : DeviceArray<T>(values.size(), device) {
    copy_bytes(reinterpret_cast<std::byte*>(this->data()), device, reinterpret_cast<const std::byte*>(values.data()),
               Device{}, values.size() * sizeof(T));
  }
};

/// Returns a host copy of an array on `device`.
template <typename T>
std::vector<std::remove_const_t<T>> host_copy(Span<T> array, Device device) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<std::remove_const_t<T>> copy(array.size());
  copy_bytes(reinterpret_cast<std::byte*>(copy.data()), Device{}, reinterpret_cast<const std::byte*>(array.data()),
             device, array.size() * sizeof(T));
  return copy;
}

}  // namespace pictura
