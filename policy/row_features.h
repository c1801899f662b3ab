// Features, computed from observed rows, that distinguish close positions near the agent. Networks learn slowly to use
// small differences, and observations divide positions by 120 m.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// Returns the features of rows [..., columns]: [..., features.count()], without gradient, between -1 and 1. Their
/// order is:
/// - for each point (x, y): p / (|p| + 4 m) for p = x, y; then p / (|p| + 20 m) for p = x, y; then (x, y) / (distance
///   of the point + 1 m);
/// - for a segment: p / (|p| + 4 m) for p = u, v; then p / (|p| + 20 m) for p = u, v. Here, u and v are the agent's
///   coordinates along the segment from its middle, and to its left.
at::Tensor row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

/// Returns rows, each followed by its features.
at::Tensor with_row_features(const at::Tensor& rows, const RowFeatures& features, at::ScalarType type);

}  // namespace pictura
