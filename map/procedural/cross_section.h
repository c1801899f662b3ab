// Cross-sections of roads, and lane sections made from them.
#pragma once

#include <optional>

#include "pictura/map/procedural/layout.h"

namespace pictura::town {

enum class LaneKind { median, driving, slip, parking, shoulder, sidewalk };

/// One side of a road. Lanes from the reference line outwards: half of a median, driving lanes, a slip lane (for right
/// turns), a parking bay, a shoulder and a sidewalk.
struct Side {
  int driving = 1;
  bool has_median = false, has_slip = false, has_parking = false, has_shoulder = true, has_sidewalk = true;

  /// Returns the position of a lane, counted from 1 at the reference line, or 0 without such a lane. `index` selects a
  /// driving lane.
  int rank(LaneKind kind, int index = 0) const;
  /// Returns the index of the driving lane at a position.
  int index_at(int rank) const { return rank - 1 - (has_median ? 1 : 0); }
  int count() const;
  LaneKind kind_at(int rank) const;
};
inline constexpr Side kNoSide{.driving = 0, .has_shoulder = false, .has_sidewalk = false};

/// Properties of a lane section, except the kinds of its lanes.
struct SectionStyle {
  explicit SectionStyle(double lane_width_m)
      : driving_from_m(lane_width_m), driving_middle_m(lane_width_m), driving_to_m(lane_width_m) {}

  bool in_junction = false;
  bool one_way = false;  // no left side
  // Widths of driving lanes along the section. Slip lanes have the first width.
  double driving_from_m, driving_middle_m, driving_to_m;
};

// Distance of parking bays from the ends of their section, and length over which they widen and narrow.
inline constexpr double kParkingLead_m = 4, kParkingTaper_m = 4;

/// Makes a section's lanes without links. Slip lanes open towards the section's end on the right, and towards its start
/// on the left.
opendrive::FileSection make_section(double s, double end, const Side& left, const Side& right,
                                    const SectionStyle& style);

void link_sections(opendrive::FileSection* before, const Side& before_left, const Side& before_right,
                   opendrive::FileSection* after, const Side& after_left, const Side& after_right);

}  // namespace pictura::town
