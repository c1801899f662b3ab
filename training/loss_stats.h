// Statistics of an update's losses by name: tensors during computation, numbers in logs.
#pragma once

#include <ATen/ATen.h>

namespace pictura {

/// Statistics of a minibatch, or their means over several minibatches; docs/reference/run_folder.md defines them.
template <typename Number>
struct LossStatsOf {
  Number policy_loss{}, value_loss{};
  Number teacher_kl{};  // KL divergence from the teacher's actions, not multiplied by its weight
  Number entropy{}, approx_kl{}, clip_fraction{}, abs_log_ratio{};
  Number grad_norm{};  // before clipping

  /// Calls f(name, statistic) for the statistics of the action distribution, which are also logged per epoch.
  template <typename Stats, typename F>
  static void visit_actions(Stats& stats, const F& f) {
    f("entropy", stats.entropy);
    f("approx_kl", stats.approx_kl);
    f("clip_fraction", stats.clip_fraction);
    f("abs_log_ratio", stats.abs_log_ratio);
  }
  /// Calls f(name, statistic) for the statistics of a forward pass: all but the gradient norm.
  template <typename Stats, typename F>
  static void visit_losses(Stats& stats, const F& f) {
    f("policy_loss", stats.policy_loss);
    f("value_loss", stats.value_loss);
    f("teacher_kl", stats.teacher_kl);
    visit_actions(stats, f);
  }
  /// Calls f(name, statistic) for all statistics.
  template <typename Stats, typename F>
  static void visit(Stats& stats, const F& f) {
    visit_losses(stats, f);
    f("grad_norm", stats.grad_norm);
  }
};

using LossStats = LossStatsOf<double>;
using LossTensors = LossStatsOf<at::Tensor>;
constexpr int64_t kNumLossStats = sizeof(LossStats) / sizeof(double);

/// Returns the statistics of a forward pass as a row, f64 [kNumLossStats - 1], in the order of visit_losses().
inline at::Tensor stacked(const LossTensors& stats) {
  std::vector<at::Tensor> values;
  LossTensors::visit_losses(stats, [&values](const char*, const at::Tensor& value) { values.push_back(value); });
  return at::stack(values).detach().to(at::kDouble);
}

/// Returns views of the elements of a row that holds all statistics. The row is [kNumLossStats], in the order of
/// visit().
inline LossTensors elements_of(const at::Tensor& row) {
  LossTensors elements;
  int64_t i = 0;
  LossTensors::visit(elements, [&](const char*, at::Tensor& element) { element = row[i++]; });
  return elements;
}

/// Returns the numbers of a row of all statistics. The row must be on the host.
inline LossStats numbers_of(const at::Tensor& row) {
  LossStats numbers;
  const double* next = row.const_data_ptr<double>();
  LossStats::visit(numbers, [&next](const char*, double& number) { number = *next++; });
  return numbers;
}

}  // namespace pictura
