// The layer after the attention of a perspective policy, where pooled queries are concatenated instead of averaged. It
// begins as the layer of the average does, so that the policy computes what it did.
#pragma once

#include <ATen/ATen.h>

namespace pictura {

struct SavedPolicy;

/// Name of the weight [out, cameras * width] of the layer that joins the cameras, as policies and files have it; of
/// concatenated queries [out, cameras * queries * width].
inline constexpr const char* kProjection = "project.weight";

/// The weight [out, cameras * queries * width] that gives of concatenated queries what `weight`, [out, cameras *
/// width], gives of their average: weight / queries in the block of each query.
at::Tensor spread_over_queries(const at::Tensor& weight, int64_t cameras, int64_t queries);

/// The policy with concatenated queries that computes what `policy` does, whose queries are averaged. Throws Error
/// naming the file where it has no such layer.
SavedPolicy with_concatenated_queries(const SavedPolicy& policy);

}  // namespace pictura
