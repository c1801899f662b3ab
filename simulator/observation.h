// Sizes of the observation (paper, table of the policy architecture) and where it lies. docs/observation.md defines
// every slot, its unit and its scale.
#pragma once

#include "pictura/common/span.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/fields.h"

namespace pictura {

constexpr int kEgoFeatures = 9;                         // 7 and two auxiliary slots
constexpr int kMaxPartners = 16, kPartnerFeatures = 8;  // 7 and one auxiliary slot
constexpr int kMaxLanes = 80, kLaneFeatures = 7;
constexpr int kMaxBoundaries = 80, kBoundaryFeatures = 7;
constexpr int kMaxControls = 10, kControlFeatures = 7;
constexpr int kWaypointFeatures = 3;

/// Observations of all slots; entity sets are padded with zeros up to their counts.
struct ObservationView {
  Span<float> ego;           // [slots, kEgoFeatures]
  Span<float> partners;      // [slots, kMaxPartners, kPartnerFeatures]
  Span<float> lanes;         // [slots, kMaxLanes, kLaneFeatures]
  Span<float> boundaries;    // [slots, kMaxBoundaries, kBoundaryFeatures]
  Span<float> controls;      // [slots, kMaxControls, kControlFeatures]
  Span<int32_t> set_counts;  // [slots, 4] filled partners, lanes, boundaries, controls
  Span<float> conditioning;  // [slots, kNumConditioning] scaled to [-1, 1]
  Span<float> waypoints;     // [slots, kNumWaypoints, kWaypointFeatures] ego frame
};

}  // namespace pictura
