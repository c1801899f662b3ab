#include "pictura/policy/value_head.h"

#include "pictura/common/error.h"

namespace pictura {

at::Tensor symlog(const at::Tensor& x) { return x.sign() * x.abs().log1p(); }

at::Tensor symexp(const at::Tensor& x) { return x.sign() * x.abs().expm1(); }

at::Tensor value_bins(const at::TensorOptions& options) {
  return symexp(at::linspace(-kLargestBin_symlog, kLargestBin_symlog, kValueBins, options));
}

at::Tensor two_hot(const at::Tensor& values) {
  const at::Tensor bins = value_bins(values.options());
  // How far a value lies from each bin but the last to the next one, 0 to 1: what it gives to this and all later bins.
  const at::Tensor passed = ((values.unsqueeze(1) - bins.narrow(0, 0, kValueBins - 1)) / bins.diff()).clamp(0, 1);
  return at::constant_pad_nd(passed, {1, 0}, 1) - at::constant_pad_nd(passed, {0, 1}, 0);
}

at::Tensor values_of(ValueHead head, const at::Tensor& outputs) {
  switch (head) {
    case ValueHead::linear: return outputs.squeeze(1);
    case ValueHead::symlog: return symexp(outputs.squeeze(1));
    case ValueHead::two_hot: return (at::softmax(outputs, 1) * value_bins(outputs.options())).sum(1);
  }
  fail("policy: unknown value head");
}

}  // namespace pictura
