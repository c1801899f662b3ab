// Numbers for tests of layers and policies.
#pragma once

#include <ATen/ATen.h>

namespace pictura::test {

/// Numbers without a pattern, a function of shape and phase alone, in [-1, 1]: doubles that `type` holds exactly.
inline at::Tensor numbers(at::IntArrayRef shape, double phase, at::ScalarType type = at::kDouble) {
  const at::Tensor drawn = (at::arange(at::empty(shape).numel(), at::kDouble) * 1.7 + phase).sin().reshape(shape);
  return drawn.to(type).to(at::kDouble);
}

}  // namespace pictura::test
