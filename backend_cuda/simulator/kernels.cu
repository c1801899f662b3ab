// Launches of the simulator's phases on a device: one thread or group of threads per item, or one block per world.
// Kernels of a stream run in sequence, which is the barrier between phases.
#include <type_traits>

#include "pictura/backend_cuda/simulator/kernels.h"
#include "pictura/common/portable/async_copy.h"

namespace pictura::cuda {
namespace {

constexpr int kThreads = 128;  // per block of run_threads
constexpr int kTeamThreads =
    kTurn * kThreadsPerAgent;  // as wide as the loops, because a world's start is one long chain of work

struct DeviceAtomics {
  /// Returns the previous value.
  __device__ int32_t add(int32_t* value, int32_t change) const { return atomicAdd(value, change); }
  /// Returns the previous value.
  __device__ int32_t exchange(int32_t* value, int32_t other) const { return atomicExch(value, other); }
  __device__ void set_bits(uint32_t* value, uint32_t bits) const { atomicOr(value, bits); }
  __device__ void lower(int32_t* value, int32_t bound) const { atomicMin(value, bound); }
};

/// The nearest of the items added by a warp's threads: the thread of rank k holds the k-th nearest, as squared
/// distance and item.
template <int capacity>
class NearestOfWarp {
  static_assert(capacity <= kWarp);

 public:
  __device__ int count() const { return min(capacity, __popc(__ballot_sync(~0u, key_ != kNone))); }
  /// at: must be the caller's own rank.
  __device__ int32_t item(int) const { return static_cast<int32_t>(key_); }
  __device__ void add(bool is_one, float distance2, int32_t item) {
    const uint64_t added = is_one ? uint64_t{__float_as_uint(distance2)} << 32 | static_cast<uint32_t>(item) : kNone;
    const bool is_first = threadIdx.x % kWarp == 0;
    const uint64_t worst = __shfl_sync(~0u, key_, capacity - 1);
    for (uint32_t better = __ballot_sync(~0u, added < worst); better != 0; better &= better - 1) {
      const uint64_t next = __shfl_sync(~0u, added, __ffs(static_cast<int>(better)) - 1);
      const uint64_t before = __shfl_up_sync(~0u, key_, 1);
      if (next < key_) key_ = is_first || before < next ? next : before;
    }
  }
  __device__ void settle() const {}

 private:
  static constexpr uint64_t kNone = ~uint64_t{0};
  uint64_t key_ = kNone;
};

/// Consecutive threads of a warp; other threads of the warp form other groups.
template <int kGroup>
struct DeviceThreadGroup {
  static constexpr int kSize = kGroup;
  template <int capacity>
  using Nearest = NearestOfWarp<capacity>;
  float* rows = nullptr;

  __device__ static constexpr int size() { return kSize; }
  __device__ int rank() const { return static_cast<int>(threadIdx.x) % kSize; }
  __device__ void sync() const { __syncwarp(mask()); }
  __device__ bool any(bool value) const { return __any_sync(mask(), value); }
  __device__ uint32_t ballot(bool value) const { return __ballot_sync(mask(), value) >> first(); }
  __device__ int count_before(uint32_t threads) const { return __popc(threads & ((1u << rank()) - 1u)); }
  __device__ int sum(int value) const { return __reduce_add_sync(mask(), value); }
  template <typename T>
  __device__ T from(int rank, const T& value) const {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(uint32_t) == 0);
    uint32_t words[sizeof(T) / sizeof(uint32_t)];
    memcpy(words, &value, sizeof(T));
    for (uint32_t& word : words) word = __shfl_sync(mask(), word, rank, kSize);
    T result;
    memcpy(&result, words, sizeof(T));
    return result;
  }
  template <typename T>
  __device__ T of_lowest(float score, int index, const T& value) const {
    // The bits of nonnegative floats have the order of the floats.
    const uint32_t lowest = __reduce_min_sync(mask(), __float_as_uint(score));
    const bool is_lowest = __float_as_uint(score) == lowest;
    const int first_index = __reduce_min_sync(mask(), is_lowest ? index : INT_MAX);
    return from(__ffs(static_cast<int>(ballot(is_lowest && index == first_index))) - 1, value);
  }
  /// Reads a value that no kernel changes, in loads of 16 bytes.
  template <typename T>
  __device__ T read(const T& value) const {
    static_assert(std::is_trivially_copyable_v<T> && alignof(T) % sizeof(float4) == 0);
    float4 words[sizeof(T) / sizeof(float4)];
    for (size_t i = 0; i < sizeof(T) / sizeof(float4); ++i)
      words[i] = __ldg(reinterpret_cast<const float4*>(&value) + i);
    T result;
    memcpy(&result, words, sizeof(T));
    return result;
  }
  /// Returns memory for the phase's kStaging floats.
  __device__ float* staging() const { return rows; }
  /// Writes the first `filled` values of staging(), then zeros up to at least `end`, but not beyond `capacity`.
  __device__ void write(const float* values, int filled, int end, int capacity, float* out) const {
    if (capacity % 4 != 0) {
      for (int i = rank(); i < end; i += kSize) out[i] = i < filled ? values[i] : 0.0f;
      return;
    }
    for (int i = 4 * rank(); i < end; i += 4 * kSize) {
      float4 four = *reinterpret_cast<const float4*>(values + i);
      if (i + 3 >= filled) {
        four = {i < filled ? four.x : 0.0f, i + 1 < filled ? four.y : 0.0f, i + 2 < filled ? four.z : 0.0f, 0.0f};
      }
      *reinterpret_cast<float4*>(out + i) = four;
    }
  }

 private:
  __device__ static unsigned first() { return threadIdx.x % kWarp / kSize * kSize; }
  __device__ static unsigned mask() { return (~0u >> (kWarp - kSize)) << first(); }
};

/// Threads of a block.
struct DeviceTeam : DeviceAtomics {
  TeamMemory* shared;
  __device__ TeamMemory& memory() const { return *shared; }
  /// Calls body(i) for all i in [0, count), then synchronizes all threads.
  template <typename Body>
  __device__ void for_each(int count, const Body& body) const {
    for (int i = static_cast<int>(threadIdx.x); i < count; i += kTeamThreads) body(i);
    __syncthreads();
  }
  /// Calls body(group, i) for all i in [0, count), then synchronizes all threads.
  template <int kGroup, typename Body>
  __device__ void for_each_by_groups(int count, const Body& body) const {
    for (int i = static_cast<int>(threadIdx.x) / kGroup; i < count; i += kTeamThreads / kGroup) {
      body(DeviceThreadGroup<kGroup>{}, i);
    }
    __syncthreads();
  }
};

template <typename Phase>
__global__ void __launch_bounds__(kThreads) run_threads(int32_t count, Phase phase) {
  const int64_t item = int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (item < count) phase(DeviceAtomics{}, static_cast<int32_t>(item));
}

// Threads per block of groups. Blocks are small, because a block occupies its place on the multiprocessor until its
// last warp ends.
constexpr int kGroupThreads = 64;
// Blocks per multiprocessor. They leave fewer registers than the compiler would choose, but hide more latency.
template <typename Phase>
constexpr int kGroupBlocks = 10;
template <>
constexpr int kGroupBlocks<ApplyRewardAndHalt> = 16;
template <typename CommandType>
constexpr int kGroupBlocks<FinishStep<CommandType>> = 6;  // a world has only one warp
constexpr int kObserveBlocks = 16;

template <int kGroup, typename Phase>
__global__ void __launch_bounds__(kGroupThreads, kGroupBlocks<Phase>) run_groups(int32_t count, Phase phase) {
  wait_for_earlier_launch();
  const int64_t item = (int64_t{blockIdx.x} * kGroupThreads + threadIdx.x) / kGroup;
  if (item < count) phase(DeviceThreadGroup<kGroup>{}, static_cast<int32_t>(item));
}

/// Kernel of groups that have memory of their own.
template <typename Phase>
__global__ void __launch_bounds__(kGroupThreads, kObserveBlocks) run_staged_groups(int32_t count, Phase phase) {
  __shared__ float4 staging[kGroupThreads / kWarp][Phase::kStaging / 4];
  static_assert(Phase::kStaging % 4 == 0);
  wait_for_earlier_launch();
  const int64_t item = (int64_t{blockIdx.x} * kGroupThreads + threadIdx.x) / kWarp;
  DeviceThreadGroup<kWarp> group;
  group.rows = reinterpret_cast<float*>(staging[threadIdx.x / kWarp]);
  if (item < count) phase(group, static_cast<int32_t>(item));
}

/// Returns the world at index `turn` among the worlds with work, or -1 if there are fewer. All threads of a warp must
/// call this function.
template <typename Phase>
__device__ int32_t world_with_work(const Phase& phase, int32_t count, int turn) {
  for (int32_t first = 0; first < count; first += kWarp) {
    const int32_t own = first + static_cast<int32_t>(threadIdx.x) % kWarp;
    uint32_t worlds = __ballot_sync(~0u, own < count && phase.has_work(own));
    const int found = __popc(worlds);
    if (turn >= found) {
      turn -= found;
      continue;
    }
    for (; turn > 0; --turn) worlds &= worlds - 1;
    return first + __ffs(static_cast<int>(worlds)) - 1;
  }
  return -1;
}

/// Kernel of teams. Blocks take the worlds with work in turn, so that no block has two while another has none.
template <typename Phase>
__global__ void __launch_bounds__(kTeamThreads) run_teams(int32_t count, Phase phase) {
  __shared__ TeamMemory memory;
  DeviceTeam team;
  team.shared = &memory;
  for (int turn = static_cast<int>(blockIdx.x);; turn += static_cast<int>(gridDim.x)) {
    const int32_t w = world_with_work(phase, count, turn);
    if (w < 0) return;
    phase(team, w);
  }
}

/// Launcher of phases. The CUDA runtime keeps errors until the caller reads the last one.
struct DeviceLaunch {
  StepStreams streams;

  static unsigned blocks_for(int64_t threads, int block) {
    return static_cast<unsigned>((threads + block - 1) / block);
  }
  void fill(void* memory, size_t size, int byte) const { cudaMemsetAsync(memory, byte, size, streams.main); }
  void copy(void* to, const void* from, size_t size) const {
    cudaMemcpyAsync(to, from, size, cudaMemcpyDeviceToDevice, streams.main);
  }
  /// Launches a kernel that calls wait_for_earlier_launch(), so that it may begin while the previous kernel ends.
  template <typename Phase>
  void start(void (*kernel)(int32_t, Phase), int group, int32_t count, const Phase& phase) const {
    cudaLaunchAttribute attribute{};
    attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    attribute.val.programmaticStreamSerializationAllowed = 1;
    cudaLaunchConfig_t config{};
    config.gridDim = dim3(blocks_for(int64_t{count} * group, kGroupThreads));
    config.blockDim = dim3(kGroupThreads);
    config.stream = streams.main;
    config.attrs = &attribute;
    config.numAttrs = streams.may_begin_early ? 1 : 0;
    cudaLaunchKernelEx(&config, kernel, count, phase);
  }
  template <typename Phase>
  void threads(int32_t count, const Phase& phase) const {
    run_threads<<<blocks_for(count, kThreads), kThreads, 0, streams.main>>>(count, phase);
  }
  template <int kGroup, typename Phase>
  void groups(int32_t count, const Phase& phase) const {
    if constexpr (requires { Phase::kStaging; }) {
      static_assert(kGroup == kWarp);
      start(run_staged_groups<Phase>, kGroup, count, phase);
    } else {
      start(run_groups<kGroup, Phase>, kGroup, count, phase);
    }
  }
  template <typename Phase>
  void teams(int32_t count, const Phase& phase) const {
    // There may be fewer blocks than worlds, because a block of this size waits for a whole multiprocessor, even
    // without work.
    constexpr int32_t kMaxTeams = 128;
    run_teams<<<static_cast<unsigned>(min(count, kMaxTeams)), kTeamThreads, 0, streams.main>>>(count, phase);
  }
  /// Runs both in parallel: the launches of `side` on its own stream, and those of `main` on this one. Later launches
  /// wait for both.
  template <typename Side, typename Main>
  void fork_join(const Side& side, const Main& main) const {
    cudaEventRecord(streams.forked, streams.main);
    cudaStreamWaitEvent(streams.side, streams.forked, 0);
    DeviceLaunch launch = *this;
    launch.streams.main = streams.side;
    side(launch);
    main();
    cudaEventRecord(streams.joined, streams.side);
    cudaStreamWaitEvent(streams.main, streams.joined, 0);
  }
};

}  // namespace

bool may_begin_early() {
  cudaFuncAttributes attributes{};
  return cudaFuncGetAttributes(&attributes, run_groups<kWarp, PlaceCenters>) == cudaSuccess &&
         attributes.ptxVersion >= 90;
}

void launch_reset(const PhaseArrays& arrays, const uint8_t* mask, uint64_t seed, const StepStreams& streams) {
  launch_reset(DeviceLaunch{streams}, arrays, mask, seed);
}

void launch_edit(const PhaseArrays& arrays, const StateEdit& edit, const StepStreams& streams) {
  launch_edit(DeviceLaunch{streams}, arrays, edit);
}

void launch_queries(const PhaseArrays& arrays, const ObservationQueries& asked, const StepStreams& streams) {
  launch_queries(DeviceLaunch{streams}, arrays, asked);
}

void launch_publish_restored(const PhaseArrays& arrays, const StepStreams& streams) {
  launch_publish_restored(DeviceLaunch{streams}, arrays);
}

void launch_step(const PhaseArrays& arrays, const int32_t* actions, const StepStreams& streams) {
  launch_step(DeviceLaunch{streams}, arrays, actions);
}

void launch_step(const PhaseArrays& arrays, const Command* commands, const StepStreams& streams) {
  launch_step(DeviceLaunch{streams}, arrays, commands);
}

template <typename Rule>
void launch_commands(const Rule& rule, int32_t num_slots, const uint8_t* mask, Command* commands_out,
                     cudaStream_t stream) {
  DeviceLaunch{{stream}}.threads(num_slots, WriteCommands<Rule>{rule, mask, commands_out});
}
template void launch_commands(const RandomCommands&, int32_t, const uint8_t*, Command*, cudaStream_t);
template void launch_commands(const IdleCommands&, int32_t, const uint8_t*, Command*, cudaStream_t);
template void launch_commands(const TabledCommands&, int32_t, const uint8_t*, Command*, cudaStream_t);
template void launch_commands(const RecordedCommands&, int32_t, const uint8_t*, Command*, cudaStream_t);

}  // namespace pictura::cuda
