// Compositing: the weight of each fragment in a pixel's colour, and conversion of colours to image formats. A fragment
// is the part of a pixel that one face covers. For host and CUDA code.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/coverage.h"

namespace pictura {

/// Accumulator of a pixel's fragments. Its integer sums do not depend on the order of fragments.
class PixelAccumulator {
 public:
  /// Kind of a fragment. kWhole: entirely visible, weighted by its area. kPartial: partly occluded, weighted by its
  /// area times its visible share of samples. kRemainder: covers the whole pixel. kRemainder fragments share the
  /// remaining area in proportion to their visible samples.
  enum Kind : uint8_t { kWhole, kPartial, kRemainder, kNumKinds };
  struct Weight {
    float area = 0;
    Kind kind = kWhole;
  };
  /// For each kind, the factor of its fragments' weights. It is known after all fragments have been added.
  struct Shares {
    float of_kind[kNumKinds] = {1.0f, 1.0f, 1.0f};
    PICTURA_HD float of(Weight weight) const { return weight.area * of_kind[weight.kind]; }
  };

  /// Weight of a fragment. `visible`: those of its effective_samples() that no other fragment occludes.
  PICTURA_HD static Weight weight_of(const PixelCoverage& coverage, uint64_t visible) {
    const uint64_t samples = effective_samples(coverage);
    const float share = static_cast<float>(popcount(visible)) / static_cast<float>(popcount(samples));
    if (coverage.is_full()) return {share, kRemainder};
    if (visible == samples) return {coverage.area, kWhole};
    return {coverage.area * share, kPartial};
  }

  /// A fragment's weight, and its colour times the weight, in integer units.
  struct Part {
    int32_t area = 0, r = 0, g = 0, b = 0;
  };
  PICTURA_HD static Part part_of(Weight weight, Rgb color) {
    return {to_units(weight.area), to_units(weight.area * color.r), to_units(weight.area * color.g),
            to_units(weight.area * color.b)};
  }
  PICTURA_HD void add(Kind kind, const Part& part) {
    // Conditionals, because an index would force the sums into a device's local memory.
    for (int k = 0; k < kNumKinds; ++k) {
      const bool is_its = k == kind;
      part_[k].area += is_its ? part.area : 0;
      part_[k].r += is_its ? part.r : 0;
      part_[k].g += is_its ? part.g : 0;
      part_[k].b += is_its ? part.b : 0;
    }
  }
  PICTURA_HD void add(Weight weight, Rgb color) { add(weight.kind, part_of(weight, color)); }

  PICTURA_HD Shares shares() const {
    const float whole = area_of(kWhole), partial = area_of(kPartial);
    // If the areas exceed a pixel, the remainder is reduced first, and whole fragments last.
    const float for_partial = max_of(1.0f - whole, 0.0f);
    Shares shares;
    if (whole > 1.0f) shares.of_kind[kWhole] = 1.0f / whole;
    if (partial > for_partial) shares.of_kind[kPartial] = for_partial / partial;
    const float remainder = area_of(kRemainder), left = max_of(for_partial - partial, 0.0f);
    shares.of_kind[kRemainder] = remainder > 0.0f && remainder < 1.0f ? left / remainder : left;
    return shares;
  }

  PICTURA_HD Rgb color() const { return color(shares()); }
  PICTURA_HD Rgb color(const Shares& shares) const {
    Rgb color;
    for (int kind = 0; kind < kNumKinds; ++kind) {
      const float unit = shares.of_kind[kind] * (1.0f / kUnits);
      color.r += unit * static_cast<float>(part_[kind].r);
      color.g += unit * static_cast<float>(part_[kind].g);
      color.b += unit * static_cast<float>(part_[kind].b);
    }
    return color;
  }

 private:
  static constexpr float kUnits = 1 << 20;  // per 1.0; sums of a thousand fragments do not overflow
  PICTURA_HD static int32_t to_units(float value) { return static_cast<int32_t>(value * kUnits + 0.5f); }
  PICTURA_HD float area_of(Kind kind) const { return static_cast<float>(part_[kind].area) * (1.0f / kUnits); }

  Part part_[kNumKinds];
};

/// Removes samples that are visible in non-full fragments (slivers excepted) from the visible samples of full
/// fragments. for_each(visit) calls visit(coverage, &visible) for each fragment. Changes nothing for fewer than two
/// full fragments, or if no sample would remain.
template <typename ForEach>
PICTURA_HD inline void divide_remainder(ForEach&& for_each) {
  uint64_t hidden = 0, left = 0;
  int num_full = 0;
  for_each([&](const PixelCoverage& coverage, uint64_t* visible) {
    const bool is_full = coverage.is_full();
    num_full += is_full ? 1 : 0;
    hidden |= is_full || coverage.samples == 0 ? 0 : *visible;  // slivers hide nothing
    left |= is_full ? *visible : 0;
  });
  left &= ~hidden;
  if (num_full < 2 || hidden == 0 || left == 0) return;
  for_each([&](const PixelCoverage& coverage, uint64_t* visible) {
    if (coverage.is_full()) *visible &= left;
  });
}

/// Converts a channel to an IEEE half, rounded to nearest even.
PICTURA_HD inline uint16_t to_half(float channel) {
  float mantissa = saturate(channel);
  // Subnormal halves are multiples of 2^-24.
  if (mantissa < 6.103515625e-5f) return static_cast<uint16_t>(rintf(mantissa * 16777216.0f));
  int exponent = 15;
  for (; mantissa < 1.0f; --exponent) mantissa = mantissa * 2.0f;
  // A mantissa that rounds up to 2 carries into the exponent.
  return static_cast<uint16_t>(1024 * exponent + static_cast<int>(rintf((mantissa - 1.0f) * 1024.0f)));
}

PICTURA_HD inline uint8_t to_byte(float channel) { return static_cast<uint8_t>(saturate(channel) * 255.0f + 0.5f); }
/// Converts a byte's value to bfloat16, exactly.
PICTURA_HD inline uint16_t bf16_of_byte(uint8_t byte) {
  return static_cast<uint16_t>(bits_from_float(static_cast<float>(byte)) >> 16);
}
/// Packs a colour into three bytes, red lowest.
PICTURA_HD inline uint32_t to_bytes(Rgb color) {
  return uint32_t{to_byte(color.r)} | uint32_t{to_byte(color.g)} << 8 | uint32_t{to_byte(color.b)} << 16;
}
/// Inverse of to_bytes().
PICTURA_HD inline Rgb rgb_of_bytes(uint32_t bytes) {
  auto byte = [bytes](int index) { return static_cast<int>(bytes >> (8 * index) & 255u); };
  return rgb8(byte(0), byte(1), byte(2));
}

/// Weight of an agent in a view's images: among all faces, and when drawn alone. Integer sums do not depend on the
/// order of fragments.
struct VisibilitySum {
  int64_t among_all = 0, alone = 0;

  PICTURA_HD static int64_t units_of(float weight) {
    // No overflow for 64 images of 8192 x 8192 pixels.
    constexpr float kUnits = 1 << 30;
    return static_cast<int64_t>(weight * kUnits);
  }
  /// Visible share of the agent. NaN if the agent alone has weight 0.
  PICTURA_HD float share() const {
    if (alone <= 0) return float_from_bits(0x7FC00000u);
    const double share = static_cast<double>(among_all) / static_cast<double>(alone);
    return static_cast<float>(share < 1.0 ? share : 1.0);
  }
};

}  // namespace pictura
