// Sizes that both the policy's layers and the estimate of their memory need.
#pragma once

#include <string_view>

#include "pictura/configuration/config.h"
#include "pictura/policy/rules/network_passes.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/rules/ego_frame.h"

namespace pictura {

/// Number of ego features. Policies that read images lack the two auxiliary slots, which come last.
constexpr int num_ego_features(bool sees_images) { return sees_images ? kEgoFeatures - 2 : kEgoFeatures; }

/// Returns the features to compute for each row of the observation array of this name, which is an entity set or the
/// waypoints.
inline RowFeatures row_features_of(const PolicySection& policy, std::string_view array) {
  const int points = array == "controls" ? 2 : 1;  // a stop line has two ends
  const bool is_segment = array == "lanes" || array == "boundaries" || array == "walls";
  return {.points = policy.point_features ? points : 0,
          .of_segment = policy.segment_features && is_segment,
          .position_unit_m = kScalePosition_m};
}

/// Number of sines and cosines of a token's position in the image. They give attention the position independently of
/// the image size.
constexpr int kPositionFeatures = 8;

}  // namespace pictura
