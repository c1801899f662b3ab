// Statistics of losses: as tensors during an update, as numbers in logs.
#pragma once

#include <ATen/ATen.h>

namespace pictura {

/// Statistics of a minibatch, or means over minibatches; docs/reference/run_folder.md defines them.
template <typename Number>
struct LossStatsOf {
  Number policy_loss{}, value_loss{};
  Number teacher_kl{}, scene{};  // not multiplied by their weights
  Number entropy{}, approx_kl{}, clip_fraction{}, abs_log_ratio{};
  Number grad_norm{};  // before clipping

  /// Visits the action distribution's statistics, which are also logged per epoch.
  template <typename Stats, typename F>
  static void visit_actions(Stats& stats, const F& f) {
    f("entropy", stats.entropy);
    f("approx_kl", stats.approx_kl);
    f("clip_fraction", stats.clip_fraction);
    f("abs_log_ratio", stats.abs_log_ratio);
  }
  /// Visits all statistics except the gradient norm.
  template <typename Stats, typename F>
  static void visit_losses(Stats& stats, const F& f) {
    f("policy_loss", stats.policy_loss);
    f("value_loss", stats.value_loss);
    f("teacher_kl", stats.teacher_kl);
    f("scene", stats.scene);
    visit_actions(stats, f);
  }
  template <typename Stats, typename F>
  static void visit(Stats& stats, const F& f) {
    visit_losses(stats, f);
    f("grad_norm", stats.grad_norm);
  }
};

using LossStats = LossStatsOf<double>;
using LossTensors = LossStatsOf<at::Tensor>;
constexpr int64_t kNumLossStats = sizeof(LossStats) / sizeof(double);

/// Returns a row of statistics, f64 [kNumLossStats - 1], in the order of visit_losses().
inline at::Tensor stacked(const LossTensors& stats) {
  std::vector<at::Tensor> values;
  LossTensors::visit_losses(stats, [&values](const char*, const at::Tensor& value) { values.push_back(value); });
  return at::stack(values).detach().to(at::kDouble);
}

/// Returns views of the elements of a row [kNumLossStats], in the order of visit().
inline LossTensors elements_of(const at::Tensor& row) {
  LossTensors elements;
  int64_t i = 0;
  LossTensors::visit(elements, [&](const char*, at::Tensor& element) { element = row[i++]; });
  return elements;
}

/// Converts a row of all statistics, on the host.
inline LossStats numbers_of(const at::Tensor& row) {
  LossStats numbers;
  const double* next = row.const_data_ptr<double>();
  LossStats::visit(numbers, [&next](const char*, double& number) { number = *next++; });
  return numbers;
}

}  // namespace pictura
