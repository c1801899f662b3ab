// Exports weights for releases and other tools: a policy as safetensors. Has no torch headers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "pictura/common/image.h"

namespace pictura {

/// Type to which the weights of a file are rounded.
enum class WeightType {
  f32,   // unchanged
  bf16,  // half the file size, with relative steps of 2^-8
};

struct ExportedPolicy {
  int64_t parameters = 0, file_bytes = 0;
  int64_t updates = 0, agent_steps = 0;  // updates and agent-steps of the run
  std::string policy_hash;               // hash of the weights in the file
};

/// Options of an export.
struct ExportOptions {
  WeightType weights = WeightType::bf16;
  std::string commit;             // commit of the program, for the metadata
  bool average = false;           // export the weight average, which a checkpoint may hold
  std::optional<ImageSize> size;  // image size: a whole multiple k of the policy's width and height
};

/// Writes the policy of a checkpoint, or of safetensors, to `out`, as write_policy() does. With options.size, patches
/// and line floor become k times as large, and the first convolution is spread over the larger patches
/// (policy/patch_spread.h). Throws Error naming the file that cannot be read or written, or that holds no average.
/// Throws UsageError naming `size` if the policy cannot have that size.
ExportedPolicy export_policy(const std::string& policy_path, const std::string& out, const ExportOptions& options);

}  // namespace pictura
