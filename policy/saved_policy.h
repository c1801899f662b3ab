// A policy as files hold it: its weights and what it needs to drive, without the run that made it. Read from a
// checkpoint or from safetensors (https://github.com/huggingface/safetensors), which other tools read: u64 length, a
// JSON header, raw data.
#pragma once

#include <map>

#include "pictura/policy/export_policy.h"
#include "pictura/policy/policy.h"

namespace pictura {

struct SavedPolicy {
  std::string path;  // where it was read from, for messages
  Config config;
  Rig rig;
  std::string backbone_hash;  // Policy::backbone_hash; the program itself is in no file of ours
  int64_t update = 0;         // of its run: updates done
  int64_t agent_steps = 0;
  std::vector<NamedTensor> parameters;
  /// Factors of the learning rate by parameter, where they are not 1: see Optimizer::rate_factors.
  std::map<std::string, double> rate_factors;
};

/// The policy of a checkpoint, or of safetensors that write_policy wrote. Throws Error naming the file when it is
/// neither, truncated, damaged, or of another observation schema (naming the entry that differs), and with `average`,
/// which asks for the average of weights that a checkpoint holds, where it holds none.
SavedPolicy read_policy(const std::string& path, bool average = false);
/// The bytes of such a file.
std::string read_policy_file(const std::string& path);
/// What they say.
SavedPolicy parse_policy(const std::string& file, const std::string& path, bool average = false);

/// Writes safetensors under another name and renames them to path. Their metadata are text: config (TOML), schema and
/// rig (JSON), rate_factors (JSON) where there are any, backbone_hash, update, agent_steps, commit (of the program that
/// writes), and hash: FNV-1a of the whole file with the 16 digits of this hash as zeros. Throws Error naming the path.
void write_policy(const std::string& path, const SavedPolicy& policy, WeightType type, const std::string& commit);

/// Throws Error naming the file `path` and the first tensor that holds a number that is not finite: such a policy would
/// still choose actions.
void check_finite(const std::string& path, const std::vector<NamedTensor>& saved);

/// Copies `saved`, of the file `path`, into `parameters` in place. Throws Error naming the file and the first tensor
/// that is missing or of another shape, and as check_finite() does.
void restore_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                     const std::vector<NamedTensor>& parameters);

/// Gives a policy the saved parameters. Throws Error as restore_tensors does, and where the programs of their backbones
/// differ.
void restore_policy(const SavedPolicy& saved, const Policy& policy);

/// Any tensors as safetensors, in F32 or I64, with one entry of metadata: config.
void write_safetensors(const std::string& path, const std::vector<NamedTensor>& tensors,
                       const std::string& config_toml);

}  // namespace pictura
