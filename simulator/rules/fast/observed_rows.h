// Rows of entity sets, eight floats at a time.
#pragma once

#include "pictura/common/portable/float8.h"
#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/rules/ego_frame.h"

namespace pictura {

/// Transforms a position (floats 0, 1, 2) and a direction (4, 5), or two positions (0, 1, 2 and 4, 5, 6).
struct RowFrame {
  Float8 minus_origin, cos, sin;

  PICTURA_HD explicit RowFrame(const EgoFrame& frame) : RowFrame(frame, {}) {}
  PICTURA_HD static RowFrame of_two_places(const EgoFrame& frame) { return {frame, frame.origin_m}; }

  /// Applies EgoFrame::to_local() to positions and EgoFrame::turn() to directions.
  PICTURA_HD Float8 to_local(const Float8& row) const {
    const Float8 moved = row + minus_origin;
    return blend<0b00110011>(moved, moved * cos + swap_pairs(moved) * sin);
  }

 private:
  // Unused floats are -0, because x + -0 is x for every x.
  PICTURA_HD RowFrame(const EgoFrame& frame, Vec3 second_origin_m)
      : minus_origin(set8(-frame.origin_m.x, -frame.origin_m.y, -frame.origin_m.z, -0.0f, -second_origin_m.x,
                          -second_origin_m.y, -second_origin_m.z, -0.0f)),
        cos(set8(frame.forward.x, frame.forward.x, 0, 0, frame.forward.x, frame.forward.x, 0, 0)),
        sin(set8(frame.forward.y, -frame.forward.y, 0, 0, frame.forward.y, -frame.forward.y, 0, 0)) {}
};

#ifdef offsetof  // undefined under NVRTC
// load8() reads eight consecutive floats of these types.
static_assert(offsetof(AgentBox, cos_heading) == 3 * sizeof(float) &&
              offsetof(AgentBox, height_m) == 7 * sizeof(float));
static_assert(offsetof(StopLine, right_m) == 3 * sizeof(float) && sizeof(StopLine) >= 8 * sizeof(float));
#endif

// Functions without a Float8 parameter do not return a Float8. Reason: a program may contain two types named Float8,
// and a mangled name does not show which of them a function returns.

/// Writes the row of one of the nearest boxes.
PICTURA_HD inline void write_partner(const AgentBox& box, float speed_mps, const RowFrame& frame, float* row_out) {
  // x, y, z, length, cos, sin, width, height
  const Float8 turnable = permute<0, 1, 2, 5, 3, 4, 6, 7>(load8(&box.center_m.x));
  const Float8 scaled =
      frame.to_local(turnable) * set8(per(kScalePosition_m), per(kScalePosition_m), per(kScaleHeight_m),
                                      per(kScaleLength_m), 1, 1, per(kScaleWidth_m), 1);
  store8(permute<0, 1, 2, 3, 6, 4, 5, 7>(scaled), row_out);
  row_out[7] = speed_mps * per(kScaleSpeed_mps);
}

/// Writes the row of a piece, followed by a zero.
PICTURA_HD inline void write_piece(const ObservedPiece& piece, const RowFrame& frame, float* row_and_zero_out) {
  store8(frame.to_local(load8(&piece.middle_m.x)) * set8(per(kScalePosition_m), per(kScalePosition_m),
                                                         per(kScaleHeight_m), per(kScaleHalfPiece_m), 1, 1, 1, 1),
         row_and_zero_out);
}
static_assert(kLaneFeatures == 7 && kBoundaryFeatures == 7 && kWallFeatures == 7);

/// Writes the pieces with indices `chosen` into a set of `capacity` rows.
PICTURA_HD inline void write_pieces(Span<const ObservedPiece> pieces, const int32_t* chosen, int count, int capacity,
                                    const RowFrame& frame, float* rows_out) {
  // write_piece() writes a zero behind the row; behind the set's last row there is no room for it.
  const int num_followed = min_of(count, capacity - 1);
  for (int i = 0; i < num_followed; ++i, rows_out += kLaneFeatures) {
    write_piece(pieces[chosen[i]], frame, rows_out);
  }
  if (num_followed < count) {
    float row[8];
    write_piece(pieces[chosen[num_followed]], frame, row);
    for (int f = 0; f < kLaneFeatures; ++f) rows_out[f] = row[f];
  }
}

struct LocalEnds {
  Vec3 left_m, right_m;
};

/// Ends in the ego frame. `frame` must come from RowFrame::of_two_places().
PICTURA_HD inline LocalEnds ends_of(const StopLine& line, const RowFrame& frame) {
  float ends[8];
  store8(frame.to_local(permute<0, 1, 2, 6, 3, 4, 5, 7>(load8(&line.left_m.x))), ends);
  return {{ends[0], ends[1], ends[2]}, {ends[4], ends[5], ends[6]}};
}

}  // namespace pictura
