// What encoders read of an observation's rows besides the numbers in them. Observations divide positions by 120 m, so
// that a metre, which decides whether a car keeps its lane or stops before a line, is hundredths: first layers grow
// weights for it slowly. These features tell places near the agent apart.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// Features of rows, [..., features.count()], all between -1 and 1, of `type` and without gradient. rows: [...,
/// columns]. In this order:
/// - of each point x and y as p / (|p| + 4 m) and as p / (|p| + 20 m), and (x, y) over its distance plus 1 m;
/// - of a segment the agent's place beside it, along it from its middle and to the left of its line, as p / (|p| + 4 m)
///   and as p / (|p| + 20 m).
/// On a CUDA device it is one pass (rules/network_passes.h).
at::Tensor row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

/// The rows followed by these.
at::Tensor with_row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

}  // namespace pictura
