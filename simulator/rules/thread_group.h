// How several threads share the loops of one agent's rules. Rules that loop over many items take a thread group, whose
// threads run in lockstep, call the rule with the same arguments, take every size()-th item each, and all return the
// same. A host passes SingleThread. Only results that do not depend on the order of items are shared: whether any item
// satisfies a condition, and the smallest one.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// The nearest of the items offered, in ascending order of squared distance, then item.
template <int capacity>
class NearestOfOneThread {
 public:
  PICTURA_HD int count() const { return count_; }
  PICTURA_HD int32_t item(int at) const { return item_[at]; }
  PICTURA_HD float worst() const { return count_ < capacity ? 3e38f : distance2_[capacity - 1]; }
  PICTURA_HD void offer(bool is_one, float distance2, int32_t item) {
    if (!is_one || (count_ == capacity && !before(distance2, item, capacity - 1))) return;
    int at = count_ < capacity ? count_++ : capacity - 1;
    for (; at > 0 && before(distance2, item, at - 1); --at) {
      distance2_[at] = distance2_[at - 1];
      item_[at] = item_[at - 1];
    }
    distance2_[at] = distance2;
    item_[at] = item;
  }

 private:
  PICTURA_HD bool before(float distance2, int32_t item, int at) const {
    return distance2 < distance2_[at] || (distance2 == distance2_[at] && item < item_[at]);
  }

  float distance2_[capacity];
  int32_t item_[capacity];
  int count_ = 0;
};

/// A group of one thread.
struct SingleThread {
  static constexpr int kSize = 1;
  template <int capacity>
  using Nearest = NearestOfOneThread<capacity>;

  PICTURA_HD static constexpr int size() { return kSize; }
  PICTURA_HD int rank() const { return 0; }
  /// What each thread of the group wrote before, all of them see after.
  PICTURA_HD void sync() const {}
  PICTURA_HD bool any(bool value) const { return value; }
  PICTURA_HD int sum(int value) const { return value; }
  /// The value of the thread with the lowest (score, index); scores are not negative.
  template <typename T>
  PICTURA_HD T of_lowest(float, int, const T& value) const {
    return value;
  }
  /// The value of the thread of that rank.
  template <typename T>
  PICTURA_HD T from(int, const T& value) const {
    return value;
  }
};

}  // namespace pictura
