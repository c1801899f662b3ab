// In which arithmetic the network computes on a CUDA device, and whether it gives the same bits in every run.
// Parameters, the optimizer, heads, log-probabilities and losses are fp32 in all.
#pragma once

#include <ATen/autocast_mode.h>

#include "pictura/configuration/config.h"

namespace pictura {

/// Sets what torch does with products of fp32 numbers, for the whole process: IEEE arithmetic, or TF32.
void set_float32_products(Precision precision);

/// Sets, for the whole process, whether torch computes the same bits in every run: deterministic algorithms, those of
/// cuDNN too, and a workspace for cuBLAS with which it is reproducible. Torch and cuBLAS read the latter from the
/// environment variable CUBLAS_WORKSPACE_CONFIG at their first product on a device, so call this before. Throws Error
/// where that variable has another value.
void set_reproducible(bool reproducible);

/// While it lives, cuDNN times its algorithms for every new size and takes the fastest (its autotuner), unless torch is
/// set to be reproducible. For updates alone: rollouts have as many sizes as numbers of active agents.
class Autotuner {
 public:
  Autotuner();
  ~Autotuner();
  Autotuner(const Autotuner&) = delete;
  Autotuner& operator=(const Autotuner&) = delete;
};

/// While it lives, layers compute in bf16 where that is the precision, and as they are where it is another.
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
    // Weights are cast once in the scope, and again in the next: the optimizer changes them in between.
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
