// Policy in a file: its weights and all other data that it needs to drive, without the state of its run. Read from a
// checkpoint or from safetensors (policy/safetensors.h). Has no torch headers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pictura/common/camera.h"
#include "pictura/configuration/config.h"
#include "pictura/policy/export_policy.h"

namespace pictura {

/// Parameter with its name in files, in row-major order.
struct StoredTensor {
  std::string name;
  std::vector<int64_t> shape;
  std::vector<float> values;
};

/// Content of a policy file besides the weights.
struct PolicyFacts {
  std::string path;  // source file, for messages
  Config config;
  Rig rig;
  std::string backbone_hash;  // Policy::backbone_hash; policy files do not contain the program itself
  int64_t update = 0;         // completed updates of the policy's run
  int64_t agent_steps = 0;
  /// Learning-rate factors other than 1, by parameter: see Optimizer::rate_factors.
  std::map<std::string, double> rate_factors;
};

struct StoredPolicy : PolicyFacts {
  std::vector<StoredTensor> parameters;
};

/// Reads the policy of a checkpoint, or of safetensors that write_stored_policy() wrote. With `average` it reads the
/// average of weights, which a checkpoint may hold. Throws Error naming the file if it is neither, truncated or
/// damaged, if it has another observation schema (naming the entry that differs), or if it lacks a requested average.
StoredPolicy read_stored_policy(const std::string& path, bool average = false);
/// Returns the bytes of a policy file.
std::string read_policy_file(const std::string& path);
/// Parses the bytes of a policy file. Arguments and errors as for read_stored_policy().
StoredPolicy parse_stored_policy(const std::string& file, const std::string& path, bool average = false);

/// Writes safetensors to a temporary file and renames it to `path`. Metadata are text: config (TOML), schema and rig
/// (JSON), rate_factors (JSON) if there are any, backbone_hash, update, agent_steps, commit (of the program that
/// writes), and hash: FNV-1a of the whole file with the 16 digits of this hash as zeros. Throws Error naming the path.
void write_stored_policy(const std::string& path, const StoredPolicy& policy, WeightType type,
                         const std::string& commit);

/// Throws Error naming the file `path` and the first tensor with a number that is not finite: such a policy would still
/// choose actions.
void check_finite(const std::string& path, const std::vector<StoredTensor>& saved);

/// Returns the parameter of that name among `saved`, read from the file `path`. Throws Error naming the file and the
/// parameter if it is missing or of another shape.
const StoredTensor& find_parameter(const std::string& path, const std::vector<StoredTensor>& saved,
                                   const std::string& name, const std::vector<int64_t>& shape);
/// Throws Error naming the file if `saved` has another number of parameters than a network expects.
void check_parameter_count(const std::string& path, const std::vector<StoredTensor>& saved, size_t expected);

/// Returns 16 hexadecimal digits over the parameters' bytes, in their order.
std::string hash_of_parameters(const std::vector<StoredTensor>& parameters);

}  // namespace pictura
