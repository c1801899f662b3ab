// Order of an epoch's transitions. Each element is computed on its own, so threads, devices and ranks can share the
// work.
#pragma once

#include "pictura/common/rng.h"

namespace pictura {

/// Permutation of [0, size) by a Feistel network (Luby and Rackoff, 1988) that draws bits from Philox. The network
/// permutes an even number of bits, and repeats until the result is below size.
struct Permutation {
  uint64_t seed = 0;
  uint32_t update = 0, epoch = 0;
  int64_t size = 0;   // in [0, 2^60]
  int half_bits = 1;  // bits of half an element

  PICTURA_HD Permutation(uint64_t its_seed, int64_t its_update, int64_t its_epoch, int64_t its_size)
      : seed(its_seed),
        update(static_cast<uint32_t>(its_update)),
        epoch(static_cast<uint32_t>(its_epoch)),
        size(its_size) {
    while ((int64_t{1} << (2 * half_bits)) < size) ++half_bits;
  }

  /// Returns the position of element i. Needs fewer than four repetitions on average.
  PICTURA_HD int64_t operator()(int64_t i) const {
    auto element = static_cast<uint64_t>(i);
    do element = encrypted(element);
    while (element >= static_cast<uint64_t>(size));
    return static_cast<int64_t>(element);
  }

 private:
  static constexpr uint32_t kRounds = 4;

  PICTURA_HD uint64_t encrypted(uint64_t element) const {
    const uint64_t mask = (uint64_t{1} << half_bits) - 1;
    uint64_t left = element >> half_bits, right = element & mask;
    for (uint32_t round = 0; round < kRounds; ++round) {
      RandomStream stream({.seed = seed,
                           .world = static_cast<uint32_t>(right),
                           .agent = round,
                           .episode = update,
                           .step = epoch,
                           .purpose = Purpose::minibatch});
      const uint64_t next = left ^ (stream.bits() & mask);
      left = right;
      right = next;
    }
    return (left << half_bits) | right;
  }
};

}  // namespace pictura
