// Numbers for tests.
#pragma once

#include <ATen/ATen.h>

namespace pictura::test {

/// Returns numbers in [-1, 1] without an obvious pattern, which `type` represents exactly.
inline at::Tensor numbers(at::IntArrayRef shape, double phase, at::ScalarType type = at::kDouble) {
  const at::Tensor drawn = (at::arange(at::empty(shape).numel(), at::kDouble) * 1.7 + phase).sin().reshape(shape);
  return drawn.to(type).to(at::kDouble);
}

}  // namespace pictura::test
