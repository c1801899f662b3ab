// Weights for release and for other tools: a policy as safetensors. Without torch headers.
#pragma once

#include <cstdint>
#include <string>

namespace pictura {

/// What the weights of a file are rounded to.
enum class WeightType {
  f32,   // as they are
  bf16,  // half the size: relative steps of 2^-8
};

struct ExportedPolicy {
  int64_t parameters = 0, file_bytes = 0;
  int64_t updates = 0, agent_steps = 0;  // of its run
  std::string policy_hash;               // of the weights as they are in the file
};

/// Writes the policy of a checkpoint, with the average of its weights where `average` is set, or of safetensors, to
/// `out`, as write_policy does. Throws Error naming the file that cannot be read or written, or that holds no average.
ExportedPolicy export_policy(const std::string& policy_path, WeightType type, const std::string& commit,
                             const std::string& out, bool average = false);

}  // namespace pictura
