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

// X(name, type, per slot, is entity set, comment): the arrays of an observation, [slots, per slot].
#define PICTURA_OBSERVATION_ARRAYS(X)                                                  \
  X(ego, float, kEgoFeatures, false, "")                                               \
  X(partners, float, kMaxPartners* kPartnerFeatures, true, "[kMaxPartners, features]") \
  X(lanes, float, kMaxLanes* kLaneFeatures, true, "")                                  \
  X(boundaries, float, kMaxBoundaries* kBoundaryFeatures, true, "")                    \
  X(controls, float, kMaxControls* kControlFeatures, true, "")                         \
  X(set_counts, int32_t, 4, true, "filled partners, lanes, boundaries, controls")      \
  X(conditioning, float, kNumConditioning, false, "scaled to [-1, 1]")                 \
  X(waypoints, float, kNumWaypoints* kWaypointFeatures, false, "ego frame")

/// Observations of all slots; entity sets are padded with zeros up to their counts, and empty where they are not asked
/// for.
struct ObservationView {
#define X(name, type, per_slot, is_set, comment) Span<type> name;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

}  // namespace pictura
