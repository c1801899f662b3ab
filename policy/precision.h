// Arithmetic of the network on a CUDA device, and whether it gives the same bits in every run. Parameters, the
// optimizer, heads, log-probabilities and losses are fp32 at every precision.
#pragma once

#include <ATen/autocast_mode.h>

#include "pictura/configuration/config.h"

namespace pictura {

/// Sets how torch computes products of fp32 numbers, for the whole process: IEEE arithmetic, or TF32.
void set_float32_products(Precision precision);

/// Sets, for the whole process, whether torch computes the same bits in every run: deterministic algorithms, including
/// cuDNN's, and a workspace that makes cuBLAS reproducible. Torch and cuBLAS read the workspace from the environment
/// variable CUBLAS_WORKSPACE_CONFIG at their first product on a device, so this function must be called earlier. Throws
/// Error if that variable has another value.
void set_reproducible(bool reproducible);

/// Scope in which cuDNN times its algorithms for every new size and selects the fastest (its autotuner), unless torch
/// is set to be reproducible. Use it only for updates, since rollouts have a new size for every number of active
/// agents.
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
    // Weights are cast once per scope, since the optimizer changes them between scopes.
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
