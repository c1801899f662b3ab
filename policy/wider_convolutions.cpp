#include "pictura/policy/wider_convolutions.h"

#include <cmath>

#include <fmt/ranges.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

// Returns shares of the copies of input `in` of output `out`, which sum to 1. They are spread evenly over their range
// (an additive recurrence), and differ for all pairs.
std::vector<float> shares_of(int64_t copies, int64_t out, int64_t in) {
  constexpr double kSpread = 0.4;
  std::vector<double> uneven;
  double sum = 0;
  for (int64_t copy = 0; copy < copies; ++copy) {
    const double turns = 0.7548776662 * double(out) + 0.5698402910 * double(in) + 0.6180339887 * double(copy);
    uneven.push_back(1 + kSpread * (2 * (turns - std::floor(turns)) - 1));
    sum += uneven.back();
  }
  std::vector<float> shares;
  for (const double share : uneven) shares.push_back(static_cast<float>(share / sum));
  return shares;
}

// Repeats outputs, and divides weights between repeated inputs. weight: [out, in, kernel, kernel].
StoredTensor repeated_channels(const StoredTensor& weight, int64_t out_copies, int64_t in_copies) {
  const int64_t outs = weight.shape.at(0), ins = weight.shape.at(1), taps = weight.shape.at(2) * weight.shape.at(3);
  StoredTensor result{weight.name, weight.shape, {}};
  result.shape[0] *= out_copies;
  result.shape[1] *= in_copies;
  result.values.resize(weight.values.size() * static_cast<size_t>(out_copies * in_copies));
  for (int64_t out = 0; out < outs; ++out) {
    for (int64_t in = 0; in < ins; ++in) {
      const std::vector<float> shares = shares_of(in_copies, out, in);
      for (int64_t copy = 0; copy < out_copies * in_copies; ++copy) {
        const int64_t out_copy = copy / in_copies, in_copy = copy % in_copies;
        for (int64_t tap = 0; tap < taps; ++tap) {
          const int64_t at = ((out_copy * outs + out) * ins * in_copies + in_copy * ins + in) * taps + tap;
          result.values[static_cast<size_t>(at)] =
              shares[static_cast<size_t>(in_copy)] * weight.values[static_cast<size_t>((out * ins + in) * taps + tap)];
        }
      }
    }
  }
  return result;
}

bool can_widen(const std::vector<int>& from, const std::vector<int>& to) {
  if (to.size() != from.size() || to.back() != from.back()) return false;
  for (size_t i = 0; i < to.size(); ++i) {
    if (to[i] < from[i] || to[i] > PolicySection::kMaxConvChannels || to[i] % from[i] != 0) return false;
  }
  return true;
}

}  // namespace

StoredPolicy widened_policy(const StoredPolicy& policy, const std::vector<int>& channels) {
  check_has_convolutions(policy, "channels");
  const std::vector<int>& before = policy.config.policy.conv_channels;
  if (!can_widen(before, channels)) {
    fail_usage("{}: channels: expected multiples of {}, up to {}, and the last one unchanged, got {}", policy.path,
               fmt::join(before, ", "), PolicySection::kMaxConvChannels, fmt::join(channels, ", "));
  }
  StoredPolicy result = policy;
  result.config.policy.conv_channels = channels;
  int64_t in_copies = 1;
  for (size_t layer = 0; layer < channels.size(); ++layer) {
    const int64_t out_copies = channels[layer] / before[layer];
    StoredTensor& weight = find_parameter(&result, fmt::format("conv.{}.weight", layer));
    StoredTensor& bias = find_parameter(&result, fmt::format("conv.{}.bias", layer));
    weight = repeated_channels(weight, out_copies, in_copies);
    const std::vector<float> once = bias.values;
    for (int64_t copy = 1; copy < out_copies; ++copy) bias.values.insert(bias.values.end(), once.begin(), once.end());
    bias.shape[0] *= out_copies;
    in_copies = out_copies;
  }
  return result;
}

}  // namespace pictura
