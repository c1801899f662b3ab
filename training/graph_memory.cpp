// Memory of captured graphs: a private pool of torch's allocator, used through virtual functions only, because torch's
// CUDA library is not linked.
#include "pictura/training/repeated_work.h"

#ifdef PICTURA_TORCH_HAS_CUDA
#include <atomic>

#include <c10/cuda/CUDACachingAllocator.h>
#endif

#include "pictura/common/array.h"
#include "pictura/common/error.h"

namespace pictura {

#ifdef PICTURA_TORCH_HAS_CUDA
namespace {

c10::cuda::CUDACachingAllocator::CUDAAllocator* torch_allocator() {
  return static_cast<c10::cuda::CUDACachingAllocator::CUDAAllocator*>(c10::getDeviceAllocator(c10::kCUDA));
}

// Ids far above torch's own, which count up from 1.
uint64_t new_id() {
  static std::atomic<uint64_t> next{uint64_t{1} << 62};
  return next++;
}

c10::MempoolId_t pool_of(uint64_t id) { return {id, 0}; }

}  // namespace

void GraphMemory::allocate_within(Stream stream, const std::function<void()>& work) {
  if (id_ == 0) id_ = new_id();
  const auto index = static_cast<c10::DeviceIndex>(device_.index);
  const auto is_own = [stream](cudaStream_t other) { return other == stream.handle; };
  torch_allocator()->beginAllocateToPool(index, pool_of(id_), is_own);
  ++uses_;
  struct End {
    c10::DeviceIndex index;
    c10::MempoolId_t pool;
    ~End() { torch_allocator()->endAllocateToPool(index, pool); }
  } const end{index, pool_of(id_)};
  work();
}

void GraphMemory::release_cached_memory() const { torch_allocator()->emptyCache(); }

void GraphMemory::release() {
  if (id_ == 0) return;
  for (; uses_ > 0; --uses_) {
    torch_allocator()->releasePool(static_cast<c10::DeviceIndex>(device_.index), pool_of(id_));
  }
  // Returns the memory to the device, because renderers and simulators allocate outside torch.
  torch_allocator()->emptyCache(pool_of(id_));
  id_ = 0;
}

GraphMemory::~GraphMemory() {
  try {
    release();
  } catch (const std::exception&) {
    // A device failure is thrown by the next call that waits for the device.
  }
}
#else
GraphMemory::~GraphMemory() = default;
void GraphMemory::allocate_within(Stream, const std::function<void()>&) {
  fail("graphs: this torch has no graphs for {}", name_of(device_));
}
void GraphMemory::release_cached_memory() const {}
void GraphMemory::release() {}
#endif

}  // namespace pictura
