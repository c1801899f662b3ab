// Rules of the learner on a CUDA device: launches, and the counts that the host needs.
#include <memory>
#include <string>

#include "pictura/backend_cuda/learner/kernels.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#include "pictura/training/rules/learner_executor.h"

namespace pictura {

std::unique_ptr<LearnerExecutor> make_cuda_learner_executor(Device device);
std::string cuda_product_name(Device device);

namespace {

cudaStream_t handle_of(Stream stream) { return static_cast<cudaStream_t>(stream.handle); }

class LearnerExecutorCuda final : public LearnerExecutor {
 public:
  /// Constructs the executor for the current device.
  LearnerExecutorCuda() : device_(current_device()) {}
  Device device() const override { return device_; }

  int64_t memory_bytes() const override {
    const DeviceGuard guard(device_);
    size_t free_bytes = 0, total_bytes = 0;
    PICTURA_CUDA(cudaMemGetInfo(&free_bytes, &total_bytes));
    return static_cast<int64_t>(free_bytes);
  }

  int64_t select_deciding(const DecidingSlots& asked, Span<int64_t> slots_out, Stream stream) override {
    return select(asked, slots_out.size(), slots_out, handle_of(stream));
  }

  void choose_actions(const SimulatorArrays& input, Span<const int64_t> slots, Span<const float> log_probs,
                      const ActionChoice& choice, Span<int32_t> actions_out, Stream stream) override {
    const DeviceGuard guard(device_);
    cuda::launch_choose_actions(ActionRule(input, choice), slots, log_probs.data(), actions_out.data(),
                                handle_of(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

  void write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Span<Command> commands_out,
                      Stream stream) override {
    const DeviceGuard guard(device_);
    cuda::launch_write_commands(actions, mask, commands_out.data(), handle_of(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

  void compute_advantages(const TransitionArrays& transitions, float gamma, float gae_lambda,
                          Span<float> advantages_out, Stream stream) override {
    const DeviceGuard guard(device_);
    cuda::launch_compute_advantages(transitions, gamma, gae_lambda, advantages_out.data(), handle_of(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

  void count_advantages(Span<const float> advantages, Span<const uint8_t> valid, Span<int64_t> counts_inout,
                        Stream stream) override {
    const DeviceGuard guard(device_);
    cuda::launch_count_advantages(advantages, valid, counts_inout.data(), handle_of(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

  int64_t select_kept(Span<const float> advantages, Span<const uint8_t> valid, float threshold, Span<int64_t> kept_out,
                      Stream stream) override {
    return select(cuda::KeptTransitions{advantages, valid, threshold}, advantages.size(), kept_out, handle_of(stream));
  }

  void permute(const Permutation& permutation, Span<const int64_t> items, Span<int64_t> items_out,
               Stream stream) override {
    const DeviceGuard guard(device_);
    cuda::launch_permute(permutation, items, items_out.data(), handle_of(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

 private:
  template <typename Rule>
  int64_t select(const Rule& rule, size_t count, Span<int64_t> items_out, cudaStream_t stream) {
    const DeviceGuard guard(device_);
    const auto signed_count = static_cast<int64_t>(count);
    size_t bytes = 0;
    PICTURA_CUDA(cuda::select(rule, signed_count, items_out.data(), count_.device(), nullptr, &bytes, stream));
    if (scratch_.size() < bytes) scratch_ = DeviceBuffer<uint8_t>(bytes);
    PICTURA_CUDA(cuda::select(rule, signed_count, items_out.data(), count_.device(), scratch_.data(), &bytes, stream));
    PICTURA_CUDA(cudaStreamSynchronize(stream));
    return *count_.host();
  }

  Device device_;
  DeviceBuffer<uint8_t> scratch_;  // grows to the size of the largest selection
  MappedValue<int64_t> count_;
};

}  // namespace

std::string cuda_product_name(Device device) {
  cudaDeviceProp properties{};
  PICTURA_CUDA(cudaGetDeviceProperties(&properties, device.index));
  return properties.name;
}

std::unique_ptr<LearnerExecutor> make_cuda_learner_executor(Device device) {
  const DeviceGuard guard(device);
  return std::make_unique<LearnerExecutorCuda>();
}

}  // namespace pictura
