// What the critic's head says of values (policy.value_head). A linear head predicts the value itself, with a squared
// error. The other two spread small returns and press large ones together, after Hafner et al., "Mastering Diverse
// Domains through World Models" (2023): symlog predicts symlog(value), with a squared error there; two_hot predicts how
// probable each of kValueBins values is, with the cross-entropy to the two that the return lies between, and its value
// is the expectation.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/network_shape.h"

namespace pictura {

/// Symlog of the largest bin; the least is its negative. Returns beyond +-402 count as these.
constexpr double kLargestBin_symlog = 6;

/// sign(x) log(1 + |x|): nearly x around 0, a logarithm of large numbers.
at::Tensor symlog(const at::Tensor& x);
/// The inverse of symlog.
at::Tensor symexp(const at::Tensor& x);

/// The values of the bins, ascending [kValueBins]: symexp of equal steps, so that bins are dense around 0.
at::Tensor value_bins(const at::TensorOptions& options);

/// Weights of the bins [batch, kValueBins] for values [batch]: 0 but for the two bins that a value lies between, or the
/// one at an end. They add up to 1, and their mean of the bins' values is the value.
at::Tensor two_hot(const at::Tensor& values);

/// Values [batch] in units of rewards, of a head's outputs [batch, num_value_outputs(head)].
at::Tensor values_of(ValueHead head, const at::Tensor& outputs);

}  // namespace pictura
