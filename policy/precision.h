// Precision and reproducibility of the network's arithmetic on a CUDA device. Parameters, the optimizer, actor and
// critic heads, log-probabilities and losses are fp32 at every precision.
#pragma once

#include <ATen/autocast_mode.h>

#include "pictura/configuration/config.h"

namespace pictura {

/// Sets, for the whole process, whether torch computes products of fp32 numbers in IEEE arithmetic or in TF32.
void set_float32_products(Precision precision);

/// Sets, for the whole process, whether torch computes the same bits in every run. If so, torch and cuDNN use
/// deterministic algorithms, and cuBLAS uses a workspace that makes it reproducible. Torch and cuBLAS read the size of
/// the workspace from the environment variable CUBLAS_WORKSPACE_CONFIG at their first product on a device, so call this
/// function earlier. Throws Error if the variable already has a different value.
void set_reproducible(bool reproducible);

/// Scope in which cuDNN times its algorithms for every new size and selects the fastest (autotuning). Has no effect if
/// torch is set to be reproducible. Use it only for updates of the policy: in rollouts, the size changes with the
/// number of active agents.
class Autotuner {
 public:
  Autotuner();
  ~Autotuner();
  Autotuner(const Autotuner&) = delete;
  Autotuner& operator=(const Autotuner&) = delete;
};

/// Scope in which layers compute in bf16 if `precision` is bf16; has no effect at other precisions.
class LayerPrecision {
 public:
  LayerPrecision(Precision precision, at::DeviceType device) : is_bf16_(precision == Precision::bf16), device_(device) {
    if (!is_bf16_) return;
    at::autocast::set_autocast_dtype(device_, at::kBFloat16);
    at::autocast::set_autocast_enabled(device_, true);
    at::autocast::increment_nesting();
  }
  ~LayerPrecision() {
    if (!is_bf16_) return;
    // The cache of cast weights is valid only within a scope, because the optimizer changes weights between scopes.
    if (at::autocast::decrement_nesting() == 0) at::autocast::clear_cache();
    at::autocast::set_autocast_enabled(device_, false);
  }
  LayerPrecision(const LayerPrecision&) = delete;
  LayerPrecision& operator=(const LayerPrecision&) = delete;

 private:
  bool is_bf16_;
  at::DeviceType device_;
};

}  // namespace pictura
