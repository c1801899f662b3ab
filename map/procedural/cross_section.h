// The lanes of a road, side by side, and the lane sections that they make.
#pragma once

#include <optional>

#include "pictura/map/procedural/layout.h"

namespace pictura::town {

enum class LaneKind { driving, slip, parking, shoulder, sidewalk };

/// One side of a road, from the reference line outwards: driving lanes, then a slip lane, a parking bay, a shoulder and
/// a sidewalk, each where there is one.
struct Side {
  int driving = 1;
  bool has_slip = false, has_parking = false, has_shoulder = true, has_sidewalk = true;

  /// The number of the lane of this kind (the `index`-th driving lane), from 1 at the reference line; 0: none.
  int rank(LaneKind kind, int index = 0) const;
  int count() const;
  LaneKind kind_at(int rank) const;
};

/// What a section's lanes are like beyond their kinds.
struct SectionStyle {
  bool in_junction = false;
  bool one_way = false;  // no left side
  // Width of driving lanes where they begin, half-way and where they end.
  double driving_from_m = kLaneWidth_m, driving_middle_m = kLaneWidth_m, driving_to_m = kLaneWidth_m;
};

// A street's parking bays open and close over the taper, the lead away from its section's ends.
inline constexpr double kParkingLead_m = 4, kParkingTaper_m = 4;

/// The lanes, with widths and marks but without links. Slip lanes open towards the section's end on the right, and
/// towards its start on the left.
opendrive::FileSection make_section(double s, double end, const Side& left, const Side& right,
                                    const SectionStyle& style);

/// Links the lanes of two sections of a road that follow each other.
void link_sections(opendrive::FileSection* before, const Side& before_left, const Side& before_right,
                   opendrive::FileSection* after, const Side& after_left, const Side& after_right);

}  // namespace pictura::town
