// Variant of is_in_sight() for eight pieces at a time.
#pragma once

#include "pictura/common/portable/float8.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/simulator/rules/ego_frame.h"

namespace pictura {

/// Maximum number of items that find_pieces_in_sight() writes beyond `capacity`.
constexpr int kFoundBeyond = 8;

/// Writes the visible `items` in order, and returns their number. Stops when at least `capacity` are found. found_out
/// must have room for capacity + kFoundBeyond items.
PICTURA_HD inline int find_pieces_in_sight(Span<const Vec2> middles, Span<const int32_t> items, const EgoFrame& frame,
                                           int capacity, int32_t* found_out) {
  const Float8 minus_origin_x = -frame.origin_m.x, minus_origin_y = -frame.origin_m.y;
  const Float8 cos = frame.forward.x, sin = frame.forward.y;
  const int num_items = static_cast<int>(items.size());
  int count = 0;
  const auto append_visible = [&](const int32_t* eight, uint32_t these) {
    Float8 x, y;
    gather_pairs(&middles.data()->x, eight, &x, &y);
    const Float8 from_ego_x = x + minus_origin_x, from_ego_y = y + minus_origin_y;
    const Float8 ahead = from_ego_x * cos + from_ego_y * sin, aside = cos * from_ego_y - sin * from_ego_x;
    const uint32_t seen =
        these & bits_of((magnitude(ahead - kRoadMiddle_m) <= kRoadHalf_m) & (magnitude(aside) <= kRoadAside_m));
    copy_chosen(eight, seen, found_out + count);
    count += popcount(seen);
  };
  int i = 0;
  for (; i + 8 <= num_items && count < capacity; i += 8) append_visible(items.data() + i, 0xFF);
  const int left = num_items - i;
  if (left > 0 && count < capacity) {
    if (num_items >= 8) {
      append_visible(items.data() + num_items - 8, last_lanes_mask(left));
    } else {
      int32_t few[8];
      for (int k = 0; k < 8; ++k) few[k] = items[min_of(k, left - 1)];
      append_visible(few, first_lanes_mask(left));
    }
  }
  return count;
}

}  // namespace pictura
