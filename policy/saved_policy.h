// Policy in a file: its weights and everything it needs to drive, without the state of its run. Read from a checkpoint
// or from safetensors (https://github.com/huggingface/safetensors), which other tools read: u64 length, a JSON header,
// raw data.
#pragma once

#include <map>

#include "pictura/policy/export_policy.h"
#include "pictura/policy/policy.h"

namespace pictura {

struct SavedPolicy {
  std::string path;  // source file, for messages
  Config config;
  Rig rig;
  std::string backbone_hash;  // Policy::backbone_hash; no file of ours contains the program itself
  int64_t update = 0;         // of its run: completed updates
  int64_t agent_steps = 0;
  std::vector<NamedTensor> parameters;
  /// Learning-rate factors by parameter, where they are not 1: see Optimizer::rate_factors.
  std::map<std::string, double> rate_factors;
};

/// Reads the policy of a checkpoint, or of safetensors that write_policy() wrote. With `average` it reads the average
/// of weights, which a checkpoint may hold. Throws Error naming the file if it is neither, truncated, damaged, of
/// another observation schema (naming the entry that differs), or holds no average where one is requested.
SavedPolicy read_policy(const std::string& path, bool average = false);
/// Returns the bytes of a policy file.
std::string read_policy_file(const std::string& path);
/// Parses the bytes of a policy file. Arguments and errors as for read_policy().
SavedPolicy parse_policy(const std::string& file, const std::string& path, bool average = false);

/// Writes safetensors to a temporary file and renames it to `path`. Metadata are text: config (TOML), schema and rig
/// (JSON), rate_factors (JSON) if there are any, backbone_hash, update, agent_steps, commit (of the program that
/// writes), and hash: FNV-1a of the whole file with the 16 digits of this hash as zeros. Throws Error naming the path.
void write_policy(const std::string& path, const SavedPolicy& policy, WeightType type, const std::string& commit);

/// Throws Error naming the file `path` and the first tensor with a number that is not finite: such a policy would still
/// choose actions.
void check_finite(const std::string& path, const std::vector<NamedTensor>& saved);

/// Copies `saved`, read from the file `path`, into `parameters` in place. Throws Error naming the file and the first
/// tensor that is missing or of another shape, and as check_finite() does.
void restore_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                     const std::vector<NamedTensor>& parameters);

/// Copies the saved parameters into a policy. Throws Error as restore_tensors() does, and if the programs of their
/// backbones differ.
void restore_policy(const SavedPolicy& saved, const Policy& policy);

/// Writes tensors as safetensors, in F32 or I64, with one entry of metadata: config.
void write_safetensors(const std::string& path, const std::vector<NamedTensor>& tensors,
                       const std::string& config_toml);

}  // namespace pictura
