// What an encoder reads of points besides their coordinates. Observations divide positions by 120 m, so that a metre,
// which decides whether a car keeps its lane or stops before a line, is hundredths: first layers grow weights for it
// slowly. These features tell points apart near the agent, and give their bearing.
#pragma once

#include <ATen/ATen.h>

#include "pictura/training/rules/network_passes.h"

namespace pictura {

/// Of each point.
constexpr int64_t kPointFeatures = PointSize::kFeatures;

/// rows: [..., features], each of which begins with `points` pairs (x, y) in units of kScalePosition_m. Returns
/// [..., points * kPointFeatures]: of each point x and y as p / (|p| + 4 m) and as p / (|p| + 20 m), and (x, y) over
/// its distance plus 1 m; all between -1 and 1.
/// `type`: of the result, which has no gradient. On a CUDA device it is one pass (rules/network_passes.h).
at::Tensor point_features(const at::Tensor& rows, int64_t points, at::ScalarType type);

/// The rows followed by these.
at::Tensor with_point_features(const at::Tensor& rows, int64_t points, at::ScalarType type);

}  // namespace pictura
