// Emulates a CUDA device on the host, to run kernels without a GPU. Threads of a block are fibers. Warps and threads
// run in a random order, each up to its next collective operation. It is an error if lanes of a warp wait for different
// operations. Races between two collective operations are not detected. Only one source file of a program may include
// this header, before the kernels.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <ucontext.h>

namespace pictura::emulation {

struct Dim {
  unsigned x = 0, y = 0, z = 0;
};
inline Dim thread_index, block_index, block_dim, grid_dim;

class Block {
 public:
  enum class Step { none, warp, block, done };
  static constexpr int kLanes = 32;

  /// Calls kernel() in each of `threads` threads, a multiple of the warp size.
  static void run(int threads, uint64_t seed, const std::function<void()>& kernel) {
    Block block(threads, seed, kernel);
    current() = &block;
    block.run_all();
    current() = nullptr;
  }
  static Block*& current() {
    static Block* block = nullptr;
    return block;
  }

  /// Waits for the warp's lanes and returns their values. what: name of the operation, equal in all lanes.
  const uint64_t* exchange(const char* what, uint64_t value) {
    Thread& thread = threads_[running_];
    thread.what = what;
    thread.value = value;
    wait(Step::warp);
    return warps_[running_ / kLanes].values;
  }
  void sync() { wait(Step::block); }

 private:
  struct Thread {
    ucontext_t context{};
    std::unique_ptr<char[]> stack;
    Step waits_for = Step::none;
    const char* what = "";
    uint64_t value = 0;
  };
  struct Warp {
    uint64_t values[kLanes] = {};
  };

  Block(int threads, uint64_t seed, const std::function<void()>& kernel)
      : kernel_(kernel), random_(seed), threads_(static_cast<std::size_t>(threads)), warps_(threads_.size() / kLanes) {
    constexpr std::size_t kStackBytes = 128 << 10;
    for (Thread& thread : threads_) {
      thread.stack = std::make_unique<char[]>(kStackBytes);
      getcontext(&thread.context);
      thread.context.uc_stack.ss_sp = thread.stack.get();
      thread.context.uc_stack.ss_size = kStackBytes;
      thread.context.uc_link = &scheduler_;
      makecontext(&thread.context, &Block::start, 0);
    }
  }

  static void start() {
    Block* block = current();
    block->kernel_();
    block->threads_[block->running_].waits_for = Step::done;
  }

  void wait(Step step) {
    Thread& thread = threads_[running_];
    thread.waits_for = step;
    swapcontext(&thread.context, &scheduler_);
  }

  void run_thread(std::size_t thread) {
    running_ = thread;
    thread_index = {static_cast<unsigned>(thread), 0, 0};
    threads_[thread].waits_for = Step::none;
    swapcontext(&scheduler_, &threads_[thread].context);
  }

  bool all_wait_for(Step step) const {
    return std::all_of(threads_.begin(), threads_.end(), [&](const Thread& t) { return t.waits_for == step; });
  }

  void run_warp(std::size_t warp) {
    std::size_t order[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) order[lane] = warp * kLanes + lane;
    std::shuffle(std::begin(order), std::end(order), random_);
    for (const std::size_t thread : order) run_thread(thread);
    const Thread& first = threads_[warp * kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Thread& thread = threads_[warp * kLanes + lane];
      if (thread.waits_for != first.waits_for || std::strcmp(thread.what, first.what) != 0) {
        throw std::logic_error(std::string("lanes of a warp have diverged: ") + first.what + " and " + thread.what);
      }
      warps_[warp].values[lane] = thread.value;
    }
  }

  void run_all() {
    std::vector<std::size_t> order(warps_.size());
    for (std::size_t warp = 0; warp < order.size(); ++warp) order[warp] = warp;
    for (std::size_t warp = 0; warp < warps_.size(); ++warp) run_warp(warp);
    while (!all_wait_for(Step::done)) {
      std::shuffle(order.begin(), order.end(), random_);
      const bool at_barrier = all_wait_for(Step::block);
      bool moved = false;
      for (const std::size_t warp : order) {
        const Step step = threads_[warp * kLanes].waits_for;
        if (step != Step::warp && !(step == Step::block && at_barrier)) continue;
        // Runs a random number of steps, so that some warps run far ahead.
        for (int steps = 1 << (random_() % 8); steps > 0; --steps) {
          run_warp(warp);
          moved = true;
          if (threads_[warp * kLanes].waits_for != Step::warp) break;
        }
      }
      if (!moved) throw std::logic_error("some threads wait for others that have ended");
    }
  }

  const std::function<void()>& kernel_;
  std::mt19937_64 random_;
  std::vector<Thread> threads_;
  std::vector<Warp> warps_;
  ucontext_t scheduler_{};
  std::size_t running_ = 0;
};

/// Calls kernel() in each thread of a grid of blocks, one block after another. `shared` is the shared memory, of any
/// contents at first.
template <std::size_t kBytes>
void launch_grid(int threads, Dim blocks, uint64_t seed, unsigned char (&shared)[kBytes],
                 const std::function<void()>& kernel) {
  grid_dim = blocks;
  block_dim = {static_cast<unsigned>(threads), 1, 1};
  for (unsigned block = 0; block < blocks.x * blocks.y * blocks.z; ++block) {
    block_index = {block % blocks.x, block / blocks.x % blocks.y, block / blocks.x / blocks.y};
    std::memset(shared, 0xA5, kBytes);
    Block::run(threads, seed + block, kernel);
  }
}
/// Calls launch_grid() for blocks in a row.
template <std::size_t kBytes>
void launch(int threads, unsigned blocks, uint64_t seed, unsigned char (&shared)[kBytes],
            const std::function<void()>& kernel) {
  launch_grid(threads, {blocks, 1, 1}, seed, shared, kernel);
}

template <typename Value>
uint64_t bits_of(Value value) {
  uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(Value));
  return bits;
}
template <typename Value>
Value value_of(uint64_t bits) {
  Value value;
  std::memcpy(&value, &bits, sizeof(Value));
  return value;
}

}  // namespace pictura::emulation

#define __host__
#define __device__
#define __global__
#define __grid_constant__
#define __noinline__
#define __shared__
#define __align__(bytes) __attribute__((aligned(bytes)))
#define __launch_bounds__(...)
#define threadIdx ::pictura::emulation::thread_index
#define blockIdx ::pictura::emulation::block_index
#define blockDim ::pictura::emulation::block_dim
#define gridDim ::pictura::emulation::grid_dim

struct alignas(16) uint4 {
  unsigned x, y, z, w;
};
using std::memcpy;

inline void __syncthreads() { pictura::emulation::Block::current()->sync(); }
inline void __syncwarp() { pictura::emulation::Block::current()->exchange("syncwarp", 0); }

inline unsigned __ballot_sync(unsigned, bool vote) {
  const uint64_t* votes = pictura::emulation::Block::current()->exchange("ballot", vote ? 1 : 0);
  unsigned ballot = 0;
  for (int lane = 0; lane < 32; ++lane) ballot |= votes[lane] != 0 ? 1u << lane : 0u;
  return ballot;
}
inline bool __any_sync(unsigned lanes, bool vote) { return __ballot_sync(lanes, vote) != 0; }
inline unsigned __reduce_or_sync(unsigned, unsigned bits) {
  const uint64_t* values = pictura::emulation::Block::current()->exchange("reduce_or", bits);
  unsigned all = 0;
  for (int lane = 0; lane < 32; ++lane) all |= static_cast<unsigned>(values[lane]);
  return all;
}
inline bool __all_sync(unsigned lanes, bool vote) { return __ballot_sync(lanes, vote) == ~0u; }
template <typename Value>
Value __reduce_min_sync(unsigned, Value value) {
  const uint64_t* values =
      pictura::emulation::Block::current()->exchange("reduce_min", pictura::emulation::bits_of(value));
  for (int lane = 0; lane < 32; ++lane) value = std::min(value, pictura::emulation::value_of<Value>(values[lane]));
  return value;
}
template <typename Value>
Value __reduce_max_sync(unsigned lanes, Value value) {
  return ~__reduce_min_sync(lanes, ~value);
}
template <typename Value>
Value __shfl_sync(unsigned, Value value, int from) {
  const uint64_t* values = pictura::emulation::Block::current()->exchange("shfl", pictura::emulation::bits_of(value));
  return pictura::emulation::value_of<Value>(values[from & 31]);
}
template <typename Value>
Value __shfl_up_sync(unsigned, Value value, unsigned step) {
  const int lane = static_cast<int>(threadIdx.x) & 31;
  const uint64_t* values =
      pictura::emulation::Block::current()->exchange("shfl_up", pictura::emulation::bits_of(value));
  const int from = lane - static_cast<int>(step);
  return pictura::emulation::value_of<Value>(values[from < 0 ? lane : from]);
}

template <typename Value>
Value __shfl_xor_sync(unsigned lanes, Value value, int mask) {
  return __shfl_sync(lanes, value, (static_cast<int>(threadIdx.x) & 31) ^ mask);
}

inline float rsqrtf(float x) { return 1.0f / std::sqrt(x); }
inline float __expf(float x) { return std::exp(x); }
inline int __popc(unsigned bits) { return std::popcount(bits); }
inline int __ffs(int bits) { return bits == 0 ? 0 : std::countr_zero(static_cast<unsigned>(bits)) + 1; }
inline int __float_as_int(float value) { return std::bit_cast<int>(value); }
inline float __int_as_float(int bits) { return std::bit_cast<float>(bits); }
inline float __uint_as_float(unsigned bits) { return std::bit_cast<float>(bits); }
inline unsigned __float_as_uint(float value) { return std::bit_cast<unsigned>(value); }

template <typename Value>
Value atomicExch(Value* at, std::type_identity_t<Value> value) {
  return std::exchange(*at, value);
}
template <typename Value>
Value atomicAdd(Value* at, std::type_identity_t<Value> by) {
  return atomicExch(at, *at + by);
}
template <typename Value>
Value atomicMin(Value* at, std::type_identity_t<Value> other) {
  return atomicExch(at, std::min(*at, other));
}
template <typename Value>
Value atomicMax(Value* at, std::type_identity_t<Value> other) {
  return atomicExch(at, std::max(*at, other));
}
template <typename Value>
Value atomicAnd(Value* at, std::type_identity_t<Value> other) {
  return atomicExch(at, *at & other);
}
template <typename Value>
Value atomicOr(Value* at, std::type_identity_t<Value> other) {
  return atomicExch(at, *at | other);
}
template <typename Value>
Value atomicCAS(Value* at, std::type_identity_t<Value> expected, std::type_identity_t<Value> wanted) {
  return atomicExch(at, *at == expected ? wanted : *at);
}
