#include "pictura/training/query_spread.h"

#include <algorithm>

#include "pictura/common/error.h"
#include "pictura/training/saved_policy.h"

namespace pictura {

at::Tensor spread_over_queries(const at::Tensor& weight, int64_t cameras, int64_t queries) {
  return (weight / static_cast<double>(queries))
      .unflatten(1, {cameras, 1, -1})
      .expand({-1, -1, queries, -1})
      .flatten(1);
}

SavedPolicy with_concatenated_queries(const SavedPolicy& policy) {
  SavedPolicy result = policy;
  const auto projection = std::find_if(result.parameters.begin(), result.parameters.end(),
                                       [](const NamedTensor& parameter) { return parameter.name == kProjection; });
  const auto cameras = static_cast<int64_t>(policy.rig.cameras.size());
  PICTURA_CHECK(
      projection != result.parameters.end() && projection->value.dim() == 2 && projection->value.size(1) % cameras == 0,
      "{}: of another architecture: expected a parameter '{}' [out, {} cameras x width]", policy.path, kProjection,
      cameras);
  projection->value = spread_over_queries(projection->value, cameras, policy.config.policy.num_queries);
  result.config.policy.query_pooling = QueryPooling::concatenated;
  return result;
}

}  // namespace pictura
