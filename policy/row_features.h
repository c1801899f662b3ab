// Additional features that encoders compute from an observation's rows to resolve positions near the agent.
// Observations divide positions by 120 m, so that 1 m is less than 0.01. A metre decides whether a car keeps its lane
// or stops before a line, but a network learns slowly to use such small differences.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// Returns the features of rows, [..., features.count()], of this `type` and without gradient. rows: [..., columns].
/// All features are between -1 and 1. Their order is:
/// - for each point (x, y): p / (|p| + 4 m) for p = x, y; then p / (|p| + 20 m) for p = x, y; then (x, y) / (distance
///   of the point + 1 m);
/// - for a segment: p / (|p| + 4 m) for p = u, v; then p / (|p| + 20 m) for p = u, v. Here, u and v are the agent's
///   coordinates relative to the segment: along the segment from its middle, and to the left of its line.
/// A CUDA device computes them in one pass (rules/network_passes.h).
at::Tensor row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

/// Returns rows, each followed by its features.
at::Tensor with_row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

}  // namespace pictura
