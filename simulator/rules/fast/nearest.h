// Selection of the nearest of many items, with eight distances at a time.
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/portable/float8.h"
#include "pictura/common/portable/intrinsics.h"

namespace pictura {

/// Keeps the `capacity` nearest items, ordered by squared distance, then by item. Items must not be negative. Insertion
/// has no branches, because they would be hard to predict.
template <int capacity>
class NearestOfOneThread {
 public:
  PICTURA_HD void add(bool is_one, float distance2, int32_t item) {
    keys_.insert(is_one ? key_of(distance2, item) : Keys::kNone);
    count_ += is_one;
  }
  /// Adds the items whose squared distance is less than below2, except item `except`.
  PICTURA_HD void offer_all(const Vec2* places, const int32_t* items, int num_items, int32_t except, Vec2 from,
                            float below2) {
    // Collects near items first, also without branches.
    float near_distance2[kGathered + 8];
    int32_t near_items[kGathered + 8];
    int num_near = 0;
    const auto insert_near = [&] {
      for (int i = 0; i < num_near; ++i) keys_.insert(key_of(near_distance2[i], near_items[i]));
      count_ += num_near;
      num_near = 0;
    };
    const auto gather = [&](const Vec2* eight_places, const int32_t* eight_items, uint32_t these) {
      if (num_near > kGathered - 8) insert_near();
      Float8 x, y;
      load_pairs(&eight_places->x, &x, &y);
      float distance2[8];
      const Float8 apart_x = x - from.x, apart_y = y - from.y;
      const Float8 distances2 = apart_x * apart_x + apart_y * apart_y;  // same bits as dot()
      store8(distances2, distance2);
      const uint32_t chosen = these & bits_of(distances2 < below2) & ~equal8(eight_items, except);
      copy_chosen(distance2, chosen, near_distance2 + num_near);
      copy_chosen(eight_items, chosen, near_items + num_near);
      num_near += popcount(chosen);
    };
    int i = 0;
    for (; i + 8 <= num_items; i += 8) gather(places + i, items + i, 0xFF);
    const int left = num_items - i;
    if (left > 0 && num_items >= 8) {
      gather(places + num_items - 8, items + num_items - 8, last_lanes_mask(left));
    } else if (left > 0) {
      Vec2 few_places[8];
      int32_t few_items[8];
      for (int k = 0; k < 8; ++k) {
        few_places[k] = places[min_of(k, left - 1)];
        few_items[k] = items[min_of(k, left - 1)];
      }
      gather(few_places, few_items, first_lanes_mask(left));
    }
    insert_near();
  }
  /// Must be called after the last item is added and before the functions below.
  PICTURA_HD void settle() {
    int64_t keys[Keys::kCount];
    keys_.store(keys);
    count_ = min_of(count_, capacity);
    for (int i = 0; i < capacity; ++i) items_[i] = static_cast<int32_t>(keys[i]);
  }
  PICTURA_HD int count() const { return count_; }
  PICTURA_HD int32_t item(int at) const { return items_[at]; }

 private:
  // Nonnegative floats and their bits, read as integers, have the same order.
  PICTURA_HD static int64_t key_of(float distance2, int32_t item) {
    return int64_t{static_cast<int32_t>(bits_from_float(distance2))} << 32 | item;
  }
  static constexpr int kGathered = 64;
  using Keys = SmallestKeys<(capacity + 3) / 4>;
  Keys keys_;
  int count_ = 0;
  int32_t items_[capacity];
};

}  // namespace pictura
