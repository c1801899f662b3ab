#include "pictura/training/export_policy.h"

#include <filesystem>

#include "pictura/training/saved_policy.h"

namespace pictura {

ExportedPolicy export_policy(const std::string& policy_path, WeightType type, const std::string& commit,
                             const std::string& out, bool average) {
  write_policy(out, read_policy(policy_path, average), type, commit);
  const SavedPolicy written = read_policy(out);
  ExportedPolicy result;
  for (const NamedTensor& parameter : written.parameters) result.parameters += parameter.value.numel();
  result.file_bytes = static_cast<int64_t>(std::filesystem::file_size(out));
  result.updates = written.update;
  result.agent_steps = written.agent_steps;
  result.policy_hash = hash_of_parameters(written.parameters);
  return result;
}

}  // namespace pictura
