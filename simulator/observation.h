// Sizes and arrays of the observation (paper, table of the policy architecture); see docs/reference/observation.md.
#pragma once

#include "pictura/common/span.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/fields.h"

namespace pictura {

constexpr int kEgoFeatures = 9;                         // 7 and 2 auxiliary features
constexpr int kMaxPartners = 16, kPartnerFeatures = 8;  // 7 and 1 auxiliary feature
constexpr int kMaxLanes = 80, kLaneFeatures = 7;
constexpr int kMaxBoundaries = 80, kBoundaryFeatures = 7;
constexpr int kMaxControls = 10, kControlFeatures = 7;
constexpr int kMaxWalls = 80, kWallFeatures = 7;
constexpr int kWaypointFeatures = 3;

/// Sets of observed entities, in the order of ObservationView::set_counts.
enum class EntitySet : int32_t { partners, lanes, boundaries, controls, walls };
constexpr int kNumEntitySets = 5;

/// Condition for an array: `own` arrays are always present, `sets` need SimulatorConfig::vector_observations, and
/// `walls` also need SimulatorConfig::wall_observations.
enum class ObservationPart : uint8_t { own, sets, walls };

// X(name, type, rows, features, part, comment): arrays [slots, rows, features].
#define PICTURA_OBSERVATION_ARRAYS(X)                                                                            \
  X(ego, float, 1, kEgoFeatures, ObservationPart::own, "")                                                       \
  X(partners, float, kMaxPartners, kPartnerFeatures, ObservationPart::sets, "")                                  \
  X(lanes, float, kMaxLanes, kLaneFeatures, ObservationPart::sets, "")                                           \
  X(boundaries, float, kMaxBoundaries, kBoundaryFeatures, ObservationPart::sets, "")                             \
  X(controls, float, kMaxControls, kControlFeatures, ObservationPart::sets, "")                                  \
  X(walls, float, kMaxWalls, kWallFeatures, ObservationPart::walls, "")                                          \
  X(set_counts, int32_t, 1, kNumEntitySets, ObservationPart::sets, "filled rows of each EntitySet")              \
  X(conditioning, float, 1, kNumConditioning, ObservationPart::own, "scaled; see docs/reference/observation.md") \
  X(waypoints, float, kNumWaypoints, kWaypointFeatures, ObservationPart::own, "ego frame")

/// Observations of all slots. Rows beyond an entity set's count are zeros. Arrays that are not computed are empty.
struct ObservationView {
#define X(name, type, rows, features, part, comment) Span<type> name;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

}  // namespace pictura
