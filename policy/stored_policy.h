// Policy in a file: a checkpoint, or a safetensors file (policy/safetensors.h). Includes no torch headers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pictura/common/camera.h"
#include "pictura/configuration/config.h"
#include "pictura/policy/export_policy.h"

namespace pictura {

/// Parameter in row-major order.
struct StoredTensor {
  std::string name;
  std::vector<int64_t> shape;
  std::vector<float> values;
};

/// Content of a policy file besides weights.
struct PolicyFacts {
  std::string path;  // source file, for messages
  Config config;
  Rig rig;
  std::string backbone_hash;  // Policy::backbone_hash()
  int64_t update = 0;         // completed updates
  int64_t agent_steps = 0;
  /// Factors other than 1, by parameter; see Optimizer::rate_factors.
  std::map<std::string, double> rate_factors;
};

struct StoredPolicy : PolicyFacts {
  std::vector<StoredTensor> parameters;
};

/// Reads the policy of a checkpoint or of a file of write_stored_policy(). average: reads averaged weights, which some
/// checkpoints contain. Throws Error naming the file if it is neither, is truncated or damaged, or lacks the average.
/// Throws Error naming the first different entry if its observation schema is not the current one.
StoredPolicy read_stored_policy(const std::string& path, bool average = false);
std::string read_policy_file(const std::string& path);
/// Parses a file's bytes; otherwise as read_stored_policy().
StoredPolicy parse_stored_policy(const std::string& file, const std::string& path, bool average = false);

/// Writes a safetensors file through a temporary file. Its metadata are texts: config (TOML), schema and rig (JSON),
/// rate_factors (JSON, if any), backbone_hash, update, agent_steps, commit, and hash. The hash is FNV-1a of the file
/// with zeros instead of the hash's 16 digits. Throws Error naming the path if writing fails.
void write_stored_policy(const std::string& path, const StoredPolicy& policy, WeightType type,
                         const std::string& commit);

/// Throws Error naming file and tensor if a number is not finite; such a policy would still choose actions.
void check_finite(const std::string& path, const std::vector<StoredTensor>& saved);

/// Throws UsageError naming the file and `option` if the policy does not read images with convolutions.
void check_has_convolutions(const StoredPolicy& policy, std::string_view option);

/// Return the parameter with this name. Throw Error naming file and parameter if it is missing, or has another shape.
StoredTensor& find_parameter(StoredPolicy* policy, const std::string& name);
const StoredTensor& find_parameter(const std::string& path, const std::vector<StoredTensor>& saved,
                                   const std::string& name, const std::vector<int64_t>& shape);
/// Throws Error naming the file if the number of parameters is not `expected`.
void check_parameter_count(const std::string& path, size_t saved, size_t expected);

/// Returns 16 hexadecimal digits.
std::string hash_of_parameters(const std::vector<StoredTensor>& parameters);

}  // namespace pictura
