#include "pictura/training/rollout.h"

#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/training/rules/gae.h"

namespace pictura {

namespace {

double physical_memory_bytes() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

template <typename T>
void copy_row(Span<const T> row, int64_t index, const at::Tensor& tensor_out) {
  std::copy(row.begin(), row.end(), tensor_out.data_ptr<T>() + index * tensor_out.size(1));
}

}  // namespace

Rollout::Rollout(Observation storage, int64_t num_steps, int64_t num_slots)
    : observation(std::move(storage)),
      values(at::zeros({num_steps + 1, num_slots}, at::kFloat)),
      actions(at::zeros({num_steps, num_slots}, at::kInt)),
      log_probs(at::zeros({num_steps, num_slots}, at::kFloat)),
      rewards(at::zeros({num_steps, num_slots}, at::kFloat)),
      terminated(at::zeros({num_steps, num_slots}, at::kByte)),
      truncated(at::zeros({num_steps, num_slots}, at::kByte)),
      valid(at::zeros({num_steps, num_slots}, at::kByte)),
      advantages(at::zeros({num_steps, num_slots}, at::kFloat)) {}

void Rollout::begin() {
  std::vector<at::Tensor> last;
  row_of(observation, num_steps()).map([&](const at::Tensor& t) { return last.emplace_back(t); });
  size_t i = 0;
  row_of(observation, 0).map([&](at::Tensor t) { return t.copy_(last[i++]); });
}

Span<int32_t> Rollout::actions_at(int64_t step) {
  return {actions.data_ptr<int32_t>() + step * num_slots(), static_cast<size_t>(num_slots())};
}

void Rollout::set_result(int64_t step, const StepResult& result) {
  copy_row(result.reward, step, rewards);
  copy_row(result.terminated, step, terminated);
  copy_row(result.truncated, step, truncated);
  copy_row(result.valid, step, valid);
}

void Rollout::compute_advantages(double gamma, double gae_lambda) {
  const float* const reward = rewards.const_data_ptr<float>();
  const float* const value = values.const_data_ptr<float>();
  const uint8_t* const is_terminated = terminated.const_data_ptr<uint8_t>();
  const uint8_t* const is_truncated = truncated.const_data_ptr<uint8_t>();
  const uint8_t* const is_valid = valid.const_data_ptr<uint8_t>();
  float* const advantage_out = advantages.data_ptr<float>();
  const int64_t slots = num_slots();
  // Steps are walked backwards and slots forwards: the inner loop runs over consecutive memory.
  std::vector<float> next(static_cast<size_t>(slots), 0.0f);
  for (int64_t step = num_steps() - 1; step >= 0; --step) {
    for (int64_t slot = 0; slot < slots; ++slot) {
      const int64_t i = step * slots + slot;
      const GaeTransition transition{
          reward[i], value[i], value[i + slots], is_terminated[i] != 0, is_truncated[i] != 0, is_valid[i] != 0};
      float& advantage = next[static_cast<size_t>(slot)];
      advantage = gae_advantage(transition, advantage, static_cast<float>(gamma), static_cast<float>(gae_lambda));
      advantage_out[i] = advantage;
    }
  }
}

Observation allocate_rollout(const Observer& observer, int num_slots, int num_steps) {
  const int64_t rows = int64_t{num_steps} + 1;
  const double row_bytes = observer.bytes_per_row(), bytes = static_cast<double>(rows) * row_bytes;
  PICTURA_CHECK(
      bytes <= physical_memory_bytes(),
      "train: a rollout of {} agents (simulator.num_slots) and {} steps (train.num_steps) needs {:.1f} GB for "
      "observations of {:.0f} bytes; this machine has {:.1f} GB",
      num_slots, num_steps, bytes / 1e9, row_bytes / num_slots, physical_memory_bytes() / 1e9);
  return observer.allocate(rows);
}

}  // namespace pictura
