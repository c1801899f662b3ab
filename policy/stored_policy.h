// Policy in a file: its weights and all other data that are needed to run it, without the state of its training. The
// file is a checkpoint or a safetensors file (policy/safetensors.h). Includes no torch headers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pictura/common/camera.h"
#include "pictura/configuration/config.h"
#include "pictura/policy/export_policy.h"

namespace pictura {

/// Parameter as it is stored in files, in row-major order.
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
  std::string backbone_hash;  // Policy::backbone_hash(); policy files do not contain the backbone program itself
  int64_t update = 0;         // number of completed updates of the training run
  int64_t agent_steps = 0;
  /// Learning-rate factors that are not 1, by name of the parameter; see Optimizer::rate_factors.
  std::map<std::string, double> rate_factors;
};

struct StoredPolicy : PolicyFacts {
  std::vector<StoredTensor> parameters;
};

/// Reads the policy of a checkpoint, or of a safetensors file that write_stored_policy() wrote. With `average`, it
/// reads the average of weights, which some checkpoints contain. Throws Error, which names the file, if the file is
/// neither, is truncated or damaged, or has no average although `average` is set. Also throws Error if its observation
/// schema differs from the current schema; the message names the first different entry.
StoredPolicy read_stored_policy(const std::string& path, bool average = false);
/// Returns the bytes of a policy file.
std::string read_policy_file(const std::string& path);
/// Parses the bytes of a policy file. Otherwise as read_stored_policy().
StoredPolicy parse_stored_policy(const std::string& file, const std::string& path, bool average = false);

/// Writes a safetensors file: first to a temporary file, which is then renamed to `path`. The metadata are texts:
/// config (TOML), schema and rig (JSON), rate_factors (JSON, if there are any), backbone_hash, update, agent_steps,
/// commit (of this program), and hash. The hash is FNV-1a of the whole file with zeros in place of the 16 digits of the
/// hash. Throws Error, which names the path, if the file cannot be written.
void write_stored_policy(const std::string& path, const StoredPolicy& policy, WeightType type,
                         const std::string& commit);

/// Throws Error, which names the file `path` and the tensor, if a number is not finite. Without this check, such a
/// policy would still choose actions.
void check_finite(const std::string& path, const std::vector<StoredTensor>& saved);

/// Returns the parameter with this name among `saved`, which were read from the file `path`. Throws Error, which names
/// the file and the parameter, if the parameter is missing or has another shape.
const StoredTensor& find_parameter(const std::string& path, const std::vector<StoredTensor>& saved,
                                   const std::string& name, const std::vector<int64_t>& shape);
/// Throws Error, which names the file, if the number of parameters is not `expected`.
void check_parameter_count(const std::string& path, const std::vector<StoredTensor>& saved, size_t expected);

/// Returns the hash of the parameters' bytes in their order: 16 hexadecimal digits.
std::string hash_of_parameters(const std::vector<StoredTensor>& parameters);

}  // namespace pictura
