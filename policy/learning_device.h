// Where a network computes, and arrays in its memory. Without torch headers: torch_device.cpp has what of it is
// torch's, host_device.cpp what builds without torch have instead, which compute on the host alone.
#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/configuration/config.h"

namespace pictura {

/// Device on which this configuration learns, in the process with this local rank. If the configuration leaves the
/// device open and there are several, the rank selects it. Opens torch's CUDA library for a CUDA device. Throws Error
/// naming the key and the reason if the configuration cannot learn there, or if the simulator or the renderer uses
/// other memory.
Device open_learning_device(const Config& config, int local_rank = 0);

/// The stream of a device on which the network computes: torch's current one.
Stream current_stream(Device device);

/// Uninitialised memory of a device, for as long as the pointer lives.
std::shared_ptr<std::byte> allocate_bytes(size_t bytes, Device device);
void set_to_zero(std::byte* memory, size_t bytes, Device device);
/// Copies on the current stream. A copy to the host has been made when the call returns, and what is copied from there
/// is needed no more.
void copy_bytes(std::byte* to, Device to_device, const std::byte* from, Device from_device, size_t bytes);

/// Elements in the memory of a device.
template <typename T>
class DeviceArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Uninitialised.
  DeviceArray(size_t size, Device device) : size_(size), memory_(allocate_bytes(size * sizeof(T), device)) {}
  Span<const T> span() const { return {data(), size_}; }
  Span<T> span() { return {data(), size_}; }

 protected:
  T* data() const { return reinterpret_cast<T*>(memory_.get()); }

 private:
  size_t size_;
  std::shared_ptr<std::byte> memory_;
};

/// A copy of the host's values in the memory of `device`.
template <typename T>
class DeviceCopy : public DeviceArray<T> {
 public:
  DeviceCopy(const std::vector<T>& values, Device device) : DeviceArray<T>(values.size(), device) {
    copy_bytes(reinterpret_cast<std::byte*>(this->data()), device, reinterpret_cast<const std::byte*>(values.data()),
               Device{}, values.size() * sizeof(T));
  }
};

/// A copy on the host of an array in the memory of `device`.
template <typename T>
std::vector<std::remove_const_t<T>> host_copy(Span<T> array, Device device) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<std::remove_const_t<T>> copy(array.size());
  copy_bytes(reinterpret_cast<std::byte*>(copy.data()), Device{}, reinterpret_cast<const std::byte*>(array.data()),
             device, array.size() * sizeof(T));
  return copy;
}

}  // namespace pictura
