// Owners of device memory, and of host memory that kernels can write.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>

#include <cuda_runtime_api.h>

#include "pictura/common/cuda/check.h"
#include "pictura/common/span.h"

namespace pictura {

/// Number of allocations of device arrays by this process, for tests.
inline std::atomic<int64_t> device_allocations{0};

/// An array in device memory, initially undefined.
template <typename T>
class DeviceBuffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  DeviceBuffer() = default;
  explicit DeviceBuffer(std::size_t size) : size_(size) {
    if (size == 0) return;
    PICTURA_CUDA(cudaMalloc(reinterpret_cast<void**>(&data_), size * sizeof(T)));
    ++device_allocations;
  }
  /// Copies host memory, and waits for the copy.
  explicit DeviceBuffer(Span<const T> host) : DeviceBuffer(host.size()) {
    if (size_ > 0) PICTURA_CUDA(cudaMemcpy(data_, host.data(), size_ * sizeof(T), cudaMemcpyHostToDevice));
  }
  DeviceBuffer(DeviceBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~DeviceBuffer() {
    if (data_) cudaFree(data_);
  }

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  Span<const T> span() const { return {data_, size_}; }
  /// Copies size() elements. The host memory may then be overwritten.
  void copy_from_host(const T* host) {
    if (size_ > 0) PICTURA_CUDA(cudaMemcpy(data_, host, size_ * sizeof(T), cudaMemcpyHostToDevice));
  }
  void fill(int byte) {
    if (size_ > 0) PICTURA_CUDA(cudaMemset(data_, byte, size_ * sizeof(T)));
  }
  /// Waits for the device's work, then copies.
  void copy_to_host(T* host) const {
    if (size_ > 0) PICTURA_CUDA(cudaMemcpy(host, data_, size_ * sizeof(T), cudaMemcpyDeviceToHost));
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// A value in host memory that kernels can write.
template <typename T>
class MappedValue {
 public:
  MappedValue() {
    T* host = nullptr;
    PICTURA_CUDA(cudaHostAlloc(reinterpret_cast<void**>(&host), sizeof(T), cudaHostAllocMapped));
    host_.reset(host);
    *host = T{};
    PICTURA_CUDA(cudaHostGetDevicePointer(reinterpret_cast<void**>(&device_), host, 0));
  }

  volatile T* host() { return host_.get(); }
  T* device() { return device_; }

 private:
  struct Free {
    void operator()(T* host) const { cudaFreeHost(host); }
  };
  std::unique_ptr<T, Free> host_;
  T* device_ = nullptr;
};

}  // namespace pictura
