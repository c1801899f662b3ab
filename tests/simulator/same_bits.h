// Comparing what executors give, bit for bit, and the actions to drive them with.
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/rng.h"
#include "pictura/simulator/simulator.h"

namespace pictura::testing {

template <typename T>
bool same_bits(Span<T> a, Span<T> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// Name of the first array and element that differ; empty where all bits are equal.
inline std::string first_difference(const ObservationView& a, const ObservationView& b) {
#define X(name, type, per_slot, part, comment)                                                                    \
  if (!same_bits(a.name, b.name)) {                                                                               \
    for (size_t i = 0; i < a.name.size(); ++i) {                                                                  \
      if (!same_bits(a.name.subspan(i, 1), b.name.subspan(i, 1)))                                                 \
        return fmt::format("{}[{}], {}: {} and {}", #name, i / (per_slot), i % (per_slot), a.name[i], b.name[i]); \
    }                                                                                                             \
  }
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  return "";
}

/// Actions that keep most agents driving: mostly none, sometimes any, keyed by slot and step.
inline std::vector<int32_t> mixed_actions(int num_slots, uint32_t step) {
  constexpr int32_t kCoasting = 2 * kNumLatActions + 1;
  std::vector<int32_t> actions;
  for (int slot = 0; slot < num_slots; ++slot) {
    RandomStream random(9, 0, static_cast<uint32_t>(slot), 0, step, Purpose::action);
    actions.push_back(random.uniform() < 0.3f ? random.below(kNumActions) : kCoasting);
  }
  return actions;
}

}  // namespace pictura::testing
