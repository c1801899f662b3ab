#include "pictura/policy/torch_device.h"

#include <c10/core/CachingDeviceAllocator.h>
#include <c10/core/StreamGuard.h>
#include <c10/core/impl/VirtualGuardImpl.h>
#include <dlfcn.h>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/common/error.h"

namespace pictura {

namespace {

// Returns the reason why torch cannot compute on CUDA devices; empty if it can. Torch's CUDA library is loaded here and
// not linked, so that programs also start on machines without it.
std::string torch_cuda_unavailable_reason() {
  static const void* const library = dlopen("libtorch_cuda.so", RTLD_NOW | RTLD_GLOBAL | RTLD_NODELETE);
  if (!library) return "this torch has no CUDA (libtorch_cuda.so cannot be opened): install a torch with CUDA";
  if (!at::globalContext().hasCUDA()) return "torch finds no CUDA device: its CUDA may be newer than the driver";
  return "";
}

std::string cuda_rejection_reason() {
  const std::string no_device = cuda_unavailable_reason();
  return no_device.empty() ? torch_cuda_unavailable_reason() : no_device;
}

}  // namespace

Device open_learning_device(const Config& config, int local_rank) {
  const std::string &wanted = config.run.device, &simulator = config.simulator.backend,
                    &renderer = config.render.backend;
  // Torch's CUDA library must be loaded before all computation, because torch looks for it only once. Even a process
  // that learns on the host may use a device later.
  const std::string why_not = cuda_rejection_reason();
  const bool draws_on_host =
      config.reads_images() && (renderer == "cpu" || renderer == "null" || renderer == "gl:osmesa");
  const auto reject_on_device = [&wanted](const char* key, const std::string& value, const char* instead) {
    fail("{}: \"{}\" uses host memory, but run.device is \"{}\": set it to {}", key, value, wanted, instead);
  };
  if (wanted.starts_with("cuda")) {
    if (simulator == "cpu") reject_on_device("simulator.backend", simulator, "\"cuda\" or \"auto\"");
    if (draws_on_host) reject_on_device("render.backend", renderer, "\"cuda\", \"gl:egl\" or \"auto\"");
  }
  if (wanted == "cpu" || simulator == "cpu" || draws_on_host) {
    PICTURA_CHECK(simulator != "cuda",
                  "simulator.backend: \"cuda\" uses device memory, but run.device is \"{}\" and render.backend "
                  "\"{}\": set it to \"cpu\" or \"auto\"",
                  wanted, renderer);
    return {};
  }
  if (wanted == "auto" && simulator == "auto" && !why_not.empty()) return {};
  PICTURA_CHECK(why_not.empty(), "{}: {}", wanted == "auto" ? "simulator.backend: \"cuda\"" : "run.device: " + wanted,
                why_not);
  const int count = at::detail::getCUDAHooks().deviceCount();
  // A launcher may expose only a single device to each process, which then has index 0 at every rank.
  Device device{MemorySpace::cuda, count == 1 ? 0 : local_rank};
  if (const size_t colon = wanted.find(':'); colon != std::string::npos) {
    device.index = std::stoi(wanted.substr(colon + 1));
    PICTURA_CHECK(device.index < count, "run.device: expected cuda:0 to cuda:{}, got \"{}\"", count - 1, wanted);
  }
  PICTURA_CHECK(device.index < count, "run.device: \"{}\" is cuda:{} for LOCAL_RANK {}, but this host has {} devices",
                wanted, device.index, local_rank, count);
  return device;
}

namespace {

// Returns torch's allocator of a device, or null if it has not been used.
at::DeviceAllocator* allocator_of(Device device) {
  if (device.is_host()) return nullptr;
  at::DeviceAllocator* const allocator = at::getDeviceAllocator(torch_device(device).type());
  return allocator->initialized() ? allocator : nullptr;
}

}  // namespace

void release_unused_memory(Device device) {
  at::DeviceAllocator* const allocator = allocator_of(device);
  if (!allocator) return;
  allocator->emptyCache();
  allocator->resetPeakStats(torch_device(device).index());
}

DeviceMemory memory_of(Device device) {
  at::DeviceAllocator* const allocator = allocator_of(device);
  if (!allocator) return {};
  const c10::DeviceIndex index = torch_device(device).index();
  const auto [free, total] = allocator->getMemoryInfo(index);
  constexpr auto kAll = static_cast<size_t>(c10::CachingAllocator::StatType::AGGREGATE);
  return {static_cast<int64_t>(total) - static_cast<int64_t>(free),
          allocator->getDeviceStats(index).allocated_bytes[kAll].peak};
}

int64_t available_bytes(Device device) {
  release_unused_memory(device);
  return make_policy_executor(device)->memory_bytes();
}

at::Device torch_device(Device device) {
  return device.is_host() ? at::Device(at::kCPU) : at::Device(at::kCUDA, static_cast<c10::DeviceIndex>(device.index));
}

std::optional<c10::Stream> torch_stream(Stream stream, Device device) {
  if (device.is_host()) return std::nullopt;
  // Torch identifies the legacy default stream by 0, and other streams that it did not create by their handle.
  return c10::Stream(c10::Stream::UNSAFE, torch_device(device), reinterpret_cast<c10::StreamId>(stream.handle));
}

Stream current_stream(Device device) {
  if (device.is_host()) return {};
  const at::Device where = torch_device(device);
  return {c10::impl::VirtualGuardImpl(where.type()).getStream(where).native_handle()};
}

namespace {

at::Tensor bytes_over(const std::byte* memory, size_t bytes, Device device) {
  return tensor_over(Span<const uint8_t>(reinterpret_cast<const uint8_t*>(memory), bytes), device,
                     {static_cast<int64_t>(bytes)});
}

}  // namespace

std::shared_ptr<std::byte> allocate_bytes(size_t bytes, Device device) {
  const at::Tensor memory =
      at::empty({static_cast<int64_t>(bytes)}, at::TensorOptions(at::kByte).device(torch_device(device)));
  auto* const data = reinterpret_cast<std::byte*>(memory.data_ptr<uint8_t>());
  return {data, [memory](std::byte*) {}};  // the pointer's deleter keeps the memory alive
}

void set_to_zero(std::byte* memory, size_t bytes, Device device) { bytes_over(memory, bytes, device).zero_(); }

void copy_bytes(std::byte* to, Device to_device, const std::byte* from, Device from_device, size_t bytes) {
  if (bytes > 0) bytes_over(to, bytes, to_device).copy_(bytes_over(from, bytes, from_device));
}

OwnStream::OwnStream(Device device)
    : stream_(c10::impl::VirtualGuardImpl(torch_device(device).type()).getStreamFromGlobalPool(torch_device(device))) {}

void OwnStream::run(const std::function<void()>& work) const {
  c10::impl::VirtualGuardImpl(stream_.device_type()).getStream(stream_.device()).synchronize();
  const c10::StreamGuard guard(stream_);
  try {
    work();
  } catch (...) {
    stream_.synchronize();  // code that catches the exception may read tensors of this work
    throw;
  }
  stream_.synchronize();
}

}  // namespace pictura
