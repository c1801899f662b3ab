// Sizes of the policy's layers.
#pragma once

#include <string_view>

#include "pictura/configuration/config.h"
#include "pictura/policy/rules/network_passes.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/rules/ego_frame.h"

namespace pictura {

/// Number of ego features that a policy reads. Image policies do not read the last two, which are auxiliary.
constexpr int num_ego_features(bool sees_images) { return sees_images ? kEgoFeatures - 2 : kEgoFeatures; }
/// Number of features of ego and of partners that are not auxiliary. The auxiliary ones are the last.
constexpr int kSeenEgoFeatures = num_ego_features(/*sees_images=*/true), kSeenPartnerFeatures = kPartnerFeatures - 1;

/// Whether an array holds an entity set's members.
constexpr bool is_set(const ObservationArray& array) {
  return array.part != ObservationPart::own && array.type == ElementType::f32;
}
/// EntitySet of kObservationArrays[array_index].
constexpr int entity_set_of(size_t array_index) {
  int set = 0;
  for (size_t i = 0; i < array_index; ++i) set += is_set(kObservationArrays[i]);
  return set;
}
static_assert(entity_set_of(std::size(kObservationArrays)) == kNumEntitySets, "the list and EntitySet have equal sets");

/// Returns the features (row_features.h) for rows of `array`, an entity set or "waypoints".
inline RowFeatures row_features_of(const PolicySection& policy, std::string_view array) {
  const int points = array == "controls" ? 2 : 1;  // a stop line has two ends
  const bool is_segment = array == "lanes" || array == "boundaries" || array == "walls";
  return {.points = policy.point_features ? points : 0,
          .of_segment = policy.segment_features && is_segment,
          .position_unit_m = kScalePosition_m};
}

/// Number of features of a camera, each as wide as a token: the mean over its queries, or one for each of them.
inline int num_camera_features(const PolicySection& policy) {
  return policy.concatenate_queries ? policy.num_queries : 1;
}

/// Number of sines and cosines that encode a token's position.
constexpr int kPositionFeatures = 8;

}  // namespace pictura
