// Launches of the kernels that encode sets.
#include <algorithm>

#include "pictura/backend_cuda/learner/network_kernels.h"
#include "pictura/backend_cuda/learner/tensor_core.cuh"
// Include this after the functions of tensor cores.
#include "pictura/backend_cuda/learner/set_encoder.cuh"

namespace pictura::cuda {

namespace {

// Launches a kernel with an object of type Memory in shared memory.
template <typename Memory, typename... Parameters, typename... Arguments>
void launch(void (*kernel)(Parameters...), int64_t blocks, cudaStream_t stream, const Arguments&... arguments) {
  cudaFuncSetAttribute(reinterpret_cast<const void*>(kernel), cudaFuncAttributeMaxDynamicSharedMemorySize,
                       sizeof(Memory));
  kernel<<<static_cast<unsigned>(blocks), Memory::kThreads, sizeof(Memory), stream>>>(arguments...);
}

// Calls f with an integral constant, the number of channels.
template <typename F>
void with_channels(int64_t channels, const F& f) {
  static_assert(SetSize::supports(64, 64, 1, 1) && SetSize::supports(128, 128, 1, 1));
  if (channels == 64) return f(std::integral_constant<int, 64>());
  f(std::integral_constant<int, 128>());
}

}  // namespace

int64_t set_encoder_bytes(int64_t channels) {
  int64_t bytes = 0;
  with_channels(channels, [&bytes](auto count) {
    constexpr int kChannels = decltype(count)::value;
    bytes = std::max(sizeof(set_encoder::ForwardMemory<kChannels>), sizeof(set_encoder::BackwardMemory<kChannels>));
  });
  return bytes;
}

void launch_largest_embedding(const SetSize& size, const float* members, const int32_t* counts,
                              const SetParameters<const float>& parameters, void* out, uint8_t* which_out,
                              cudaStream_t stream) {
  if (size.sets() == 0) return;
  with_channels(size.channels, [&](auto channels) {
    constexpr int kChannels = decltype(channels)::value, kWarps = set_encoder::kWarps<kChannels>;
    // A block loads the weights once, so there are only as many blocks as run at the same time.
    constexpr int64_t kMaxBlocks = 132 * 16 / kWarps;
    launch<set_encoder::ForwardMemory<kChannels>>(
        set_encoder::largest_embedding<kChannels>, std::min((size.sets() + kWarps - 1) / kWarps, kMaxBlocks), stream,
        size, members, counts, parameters, static_cast<Half*>(out), which_out);
  });
}

void launch_largest_embedding_backward(const SetSize& size, const float* members,
                                       const SetParameters<const float>& parameters, const uint8_t* which,
                                       const void* grad_out, const SetParameters<float>& sums_out,
                                       cudaStream_t stream) {
  with_channels(size.channels, [&](auto channels) {
    constexpr int kChannels = decltype(channels)::value;
    launch<set_encoder::BackwardMemory<kChannels>>(set_encoder::largest_embedding_backward<kChannels>, SetSize::kSums,
                                                   stream, size, members, parameters, which,
                                                   static_cast<const Half*>(grad_out), sums_out);
  });
}

}  // namespace pictura::cuda
