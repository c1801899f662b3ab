// Sizes of the policy that its layers and the estimate of their memory share.
#pragma once

#include <string_view>

#include "pictura/simulator/observation.h"
#include "pictura/training/config.h"

namespace pictura {

/// Of its own state: beside images without the two auxiliary slots, which come last.
constexpr int num_ego_features(bool sees_images) { return sees_images ? kEgoFeatures - 2 : kEgoFeatures; }

/// Points that a member of a set begins with: a stop line has two ends.
constexpr int num_points(std::string_view set) { return set == "controls" ? 2 : 1; }

/// Sines and cosines of a pixel's position in the image, so that attention knows where a token is whatever the image's
/// size.
constexpr int kPositionFeatures = 8;

/// Outputs of the critic's head: one, or those of as many bins (training/value_head.h).
constexpr int kValueBins = 101;
constexpr int num_value_outputs(ValueHead head) { return head == ValueHead::two_hot ? kValueBins : 1; }

}  // namespace pictura
