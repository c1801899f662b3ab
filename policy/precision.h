// Precision and reproducibility on CUDA devices. Parameters, optimizer, heads, log-probabilities and losses are always
// fp32.
#pragma once

#include <ATen/autocast_mode.h>

#include "pictura/configuration/config.h"

namespace pictura {

/// Selects IEEE or TF32 products of fp32 numbers for the whole process.
void set_float32_products(Precision precision);

/// Sets for the whole process whether torch, cuDNN and cuBLAS compute the same bits in every run. Call it before the
/// first product on a device, during which torch reads CUBLAS_WORKSPACE_CONFIG. If `reproducible`, throws Error if this
/// variable has a value with which cuBLAS is not reproducible.
void set_reproducible(bool reproducible);

/// Scope in which cuDNN times its algorithms for every new size, and selects the fastest. Has no effect if torch is
/// reproducible. Use it only for updates, because sizes vary in rollouts.
class Autotuner {
 public:
  Autotuner();
  ~Autotuner();
  Autotuner(const Autotuner&) = delete;
  Autotuner& operator=(const Autotuner&) = delete;
};

/// Scope in which layers compute in bf16, if `precision` is bf16.
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
    // The optimizer changes weights between scopes, so cached casts become invalid.
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
