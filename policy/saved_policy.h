// Variant of policy/stored_policy.h with torch tensors.
#pragma once

#include "pictura/policy/policy.h"
#include "pictura/policy/stored_policy.h"

namespace pictura {

struct SavedPolicy : PolicyFacts {
  std::vector<NamedTensor> parameters;
};

/// Convert stored tensors to fp32 tensors on the host, and tensors on any device to stored tensors.
std::vector<NamedTensor> to_tensors(const std::vector<StoredTensor>& stored);
std::vector<StoredTensor> to_stored(const std::vector<NamedTensor>& tensors);

/// Variants of read_stored_policy(), parse_stored_policy() and write_stored_policy().
SavedPolicy read_policy(const std::string& path, bool average = false);
SavedPolicy parse_policy(const std::string& file, const std::string& path, bool average = false);
void write_policy(const std::string& path, const SavedPolicy& policy, WeightType type, const std::string& commit);

/// Copies the saved tensors with the names of `parameters` into them in place. Throws Error naming the file `path` and
/// the first tensor that is missing, not finite, or of another shape.
void copy_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                  const std::vector<NamedTensor>& parameters);
/// Copies `saved` into `parameters`. Throws as copy_tensors() does, and Error if `saved` has further tensors.
void restore_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                     const std::vector<NamedTensor>& parameters);

/// Throws as restore_tensors() does, and Error if the policies have different backbones.
void restore_policy(const SavedPolicy& saved, const Policy& policy);

/// Writes F32 or I64 tensors, with config as metadata.
void write_safetensors(const std::string& path, const std::vector<NamedTensor>& tensors,
                       const std::string& config_toml);

}  // namespace pictura
