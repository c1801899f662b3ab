// Weights for release and for other tools: a policy as safetensors. Without torch headers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "pictura/common/image.h"

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

/// How a policy is exported.
struct ExportOptions {
  WeightType weights = WeightType::bf16;
  std::string commit;             // of the program, for the metadata
  bool average = false;           // the average of its weights, which a checkpoint may hold
  std::optional<ImageSize> size;  // of images, one whole number k of times as wide and as high as its own
};

/// Writes the policy of a checkpoint, or of safetensors, to `out`, as write_policy does. With a size, patches and line
/// floor are k times as large, and the first convolution is spread over the larger patches (policy/patch_spread.h).
/// Throws Error naming the file that cannot be read or written, or that holds no average; UsageError naming `size`
/// where the policy cannot have it.
ExportedPolicy export_policy(const std::string& policy_path, const std::string& out, const ExportOptions& options);

}  // namespace pictura
