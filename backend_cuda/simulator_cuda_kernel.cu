// How the simulator's phases are started on a device: a thread per item, a block per world, or a warp per item. Kernels
// of a stream follow one another, which is the barrier between phases.
#include "pictura/backend_cuda/simulator_cuda_kernel.h"

namespace pictura::cuda {
namespace {

constexpr int kThreads = 128;  // per block
constexpr int kWarp = 32;

struct DeviceAtomics {
  /// Returns the value before.
  __device__ int32_t add(int32_t* value, int32_t change) const { return atomicAdd(value, change); }
  __device__ void lower(int32_t* value, int32_t bound) const { atomicMin(value, bound); }
  __device__ void set_bits(uint32_t* value, uint32_t bits) const { atomicOr(value, bits); }
};

/// The threads of a block.
struct DeviceTeam : DeviceAtomics {
  TeamMemory* shared;
  __device__ TeamMemory& memory() const { return *shared; }
  /// body(i) for all i in [0, count); then everybody waits for everybody.
  template <typename Body>
  __device__ void for_each(int count, const Body& body) const {
    for (int i = static_cast<int>(threadIdx.x); i < count; i += kThreads) body(i);
    __syncthreads();
  }
};

/// The lanes of a warp.
struct DeviceLanes {
  __device__ int size() const { return kWarp; }
  __device__ int rank() const { return static_cast<int>(threadIdx.x) % kWarp; }
  __device__ uint32_t ballot(bool value) const { return __ballot_sync(~0u, value); }
  __device__ int count(uint32_t lanes) const { return __popc(lanes); }
  __device__ int count_before(uint32_t lanes) const { return __popc(lanes & ((1u << rank()) - 1u)); }
  __device__ void wait() const { __syncwarp(); }
};

template <typename Phase>
__global__ void __launch_bounds__(kThreads) run_threads(int32_t count, Phase phase) {
  const int64_t item = int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (item < count) phase(DeviceAtomics{}, static_cast<int32_t>(item));
}

template <typename Phase>
__global__ void __launch_bounds__(kThreads) run_teams(Phase phase) {
  // Raw memory: TeamMemory's members have first values, which shared memory cannot have.
  __shared__ __align__(alignof(TeamMemory)) unsigned char memory[sizeof(TeamMemory)];
  DeviceTeam team;
  team.shared = reinterpret_cast<TeamMemory*>(memory);
  phase(team, static_cast<int32_t>(blockIdx.x));
}

template <typename Phase>
__global__ void __launch_bounds__(kThreads) run_warps(int32_t count, Phase phase) {
  const int64_t item = (int64_t{blockIdx.x} * kThreads + threadIdx.x) / kWarp;
  if (item < count) phase(DeviceLanes{}, static_cast<int32_t>(item));
}

/// Errors stay with the runtime until the caller asks for the last one.
struct DeviceLaunch {
  cudaStream_t stream;

  static unsigned blocks_for(int64_t threads) { return static_cast<unsigned>((threads + kThreads - 1) / kThreads); }
  void fill(void* memory, size_t size, int byte) const { cudaMemsetAsync(memory, byte, size, stream); }
  template <typename Phase>
  void threads(int32_t count, const Phase& phase) const {
    run_threads<<<blocks_for(count), kThreads, 0, stream>>>(count, phase);
  }
  template <typename Phase>
  void teams(int32_t count, const Phase& phase) const {
    run_teams<<<static_cast<unsigned>(count), kThreads, 0, stream>>>(phase);
  }
  template <typename Phase>
  void warps(int32_t count, const Phase& phase) const {
    run_warps<<<blocks_for(int64_t{count} * kWarp), kThreads, 0, stream>>>(count, phase);
  }
};

}  // namespace

void launch_reset(const SimulatorArrays& arrays, cudaStream_t stream) { launch_reset(DeviceLaunch{stream}, arrays); }

void launch_restored(const SimulatorArrays& arrays, cudaStream_t stream) {
  launch_restored(DeviceLaunch{stream}, arrays);
}

void launch_step(const SimulatorArrays& arrays, const int32_t* actions, cudaStream_t stream) {
  launch_step(DeviceLaunch{stream}, arrays, actions);
}

}  // namespace pictura::cuda
