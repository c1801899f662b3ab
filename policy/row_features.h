// Additional features that encoders compute from an observation's rows. Observations divide positions by 120 m. A
// metre, which decides whether a car keeps its lane or stops before a line, is then less than 0.01, and first layers
// learn weights for such small differences slowly. These features resolve positions near the agent.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// Features of rows, [..., features.count()], all between -1 and 1, of `type` and without gradient. rows: [...,
/// columns]. In this order:
/// - of each point: x and y as p / (|p| + 4 m) and as p / (|p| + 20 m), and (x, y) divided by the point's distance plus
///   1 m;
/// - of a segment: the agent's position relative to it (along the segment from its middle, and to the left of its
///   line), as p / (|p| + 4 m) and as p / (|p| + 20 m).
/// On a CUDA device they are computed in one pass (rules/network_passes.h).
at::Tensor row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

/// Returns rows, each followed by its features.
at::Tensor with_row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

}  // namespace pictura
