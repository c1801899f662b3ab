// Variant of policy/stored_policy.h with weights as torch tensors.
#pragma once

#include "pictura/policy/policy.h"
#include "pictura/policy/stored_policy.h"

namespace pictura {

struct SavedPolicy : PolicyFacts {
  std::vector<NamedTensor> parameters;
};

/// Copy stored tensors into fp32 torch tensors on the host, and torch tensors on any device into stored tensors.
std::vector<NamedTensor> to_tensors(const std::vector<StoredTensor>& stored);
std::vector<StoredTensor> to_stored(const std::vector<NamedTensor>& tensors);

/// Variants of read_stored_policy(), parse_stored_policy() and write_stored_policy() for a SavedPolicy.
SavedPolicy read_policy(const std::string& path, bool average = false);
SavedPolicy parse_policy(const std::string& file, const std::string& path, bool average = false);
void write_policy(const std::string& path, const SavedPolicy& policy, WeightType type, const std::string& commit);

/// Copies `saved`, read from the file `path`, into `parameters` in place. Throws Error, which names the file and the
/// tensor, if a tensor is missing, has another shape, or is not finite.
void restore_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                     const std::vector<NamedTensor>& parameters);

/// Copies the saved parameters into a policy. Throws Error as restore_tensors() does. Also throws Error if the two
/// policies have different backbones.
void restore_policy(const SavedPolicy& saved, const Policy& policy);

/// Writes tensors as a safetensors file, in F32 or I64. Its metadata contain one entry: config.
void write_safetensors(const std::string& path, const std::vector<NamedTensor>& tensors,
                       const std::string& config_toml);

}  // namespace pictura
