// Cooperation of several threads in the loops of a rule. The threads of a group run in lockstep and call the rule with
// the same arguments. Each thread processes every size()-th item. All threads return the same result. It must not
// depend on the order of items, so threads combine their results only by any(), sums of integers, and choice of the
// smallest item.
#pragma once

#include "pictura/simulator/rules/fast/nearest.h"

namespace pictura {

/// Group of one thread, for CPUs.
struct SingleThread {
  static constexpr int kSize = 1;
  template <int capacity>
  using Nearest = NearestOfOneThread<capacity>;

  PICTURA_HD static constexpr int size() { return kSize; }
  PICTURA_HD int rank() const { return 0; }
  /// Makes earlier writes visible to all threads of the group.
  PICTURA_HD void sync() const {}
  PICTURA_HD bool any(bool value) const { return value; }
  PICTURA_HD int sum(int value) const { return value; }
  /// Value of the thread with the lowest (score, index). Scores must not be negative.
  template <typename T>
  PICTURA_HD T of_lowest(float, int, const T& value) const {
    return value;
  }
  /// Value of the thread with this rank.
  template <typename T>
  PICTURA_HD T from(int, const T& value) const {
    return value;
  }
};

}  // namespace pictura
