// A policy as files hold it: its weights and what it needs to drive, without the run that made it. Read from a
// checkpoint or from safetensors (policy/safetensors.h). Without torch.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pictura/common/camera.h"
#include "pictura/configuration/config.h"
#include "pictura/policy/export_policy.h"

namespace pictura {

/// A parameter by the name under which it is saved, in row-major order.
struct StoredTensor {
  std::string name;
  std::vector<int64_t> shape;
  std::vector<float> values;
};

/// What a file says of a policy besides its weights.
struct PolicyFacts {
  std::string path;  // where it was read from, for messages
  Config config;
  Rig rig;
  std::string backbone_hash;  // Policy::backbone_hash; the program itself is in no file of ours
  int64_t update = 0;         // of its run: updates done
  int64_t agent_steps = 0;
  /// Learning-rate factors by parameter, where they are not 1: see Optimizer::rate_factors.
  std::map<std::string, double> rate_factors;
};

struct StoredPolicy : PolicyFacts {
  std::vector<StoredTensor> parameters;
};

/// The policy of a checkpoint, or of safetensors that write_stored_policy wrote. Throws Error naming the file when it
/// is neither, truncated, damaged, or of another observation schema (naming the entry that differs), and with
/// `average`, which asks for the average of weights that a checkpoint holds, where it holds none.
StoredPolicy read_stored_policy(const std::string& path, bool average = false);
/// Returns the bytes of a policy file.
std::string read_policy_file(const std::string& path);
/// What they say.
StoredPolicy parse_stored_policy(const std::string& file, const std::string& path, bool average = false);

/// Writes safetensors to a temporary file and renames it to `path`. Metadata are text: config (TOML), schema and rig
/// (JSON), rate_factors (JSON) if there are any, backbone_hash, update, agent_steps, commit (of the program that
/// writes), and hash: FNV-1a of the whole file with the 16 digits of this hash as zeros. Throws Error naming the path.
void write_stored_policy(const std::string& path, const StoredPolicy& policy, WeightType type,
                         const std::string& commit);

/// Throws Error naming the file `path` and the first tensor with a number that is not finite: such a policy would still
/// choose actions.
void check_finite(const std::string& path, const std::vector<StoredTensor>& saved);

/// The parameter of that name among `saved`, of the file `path`. Throws Error naming the file and the parameter where
/// it is missing or of another shape.
const StoredTensor& find_parameter(const std::string& path, const std::vector<StoredTensor>& saved,
                                   const std::string& name, const std::vector<int64_t>& shape);
/// Throws Error naming the file where `saved` has not as many parameters as a network expects.
void check_parameter_count(const std::string& path, const std::vector<StoredTensor>& saved, size_t expected);

/// Hash of the parameters' bytes in their order: 16 hexadecimal digits.
std::string hash_of_parameters(const std::vector<StoredTensor>& parameters);

}  // namespace pictura
