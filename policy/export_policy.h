// Export of a policy as a safetensors file. Includes no torch headers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/image.h"

namespace pictura {

/// Type of the weights in a file.
enum class WeightType {
  f32,   // unchanged
  bf16,  // 8 significant bits, which halves the file size
};

struct ExportedPolicy {
  int64_t parameters = 0, file_bytes = 0;
  int64_t updates = 0, agent_steps = 0;  // counters of training
  std::string policy_hash;               // hash of the file's weights
};

/// Options of an export.
struct ExportOptions {
  WeightType weights = WeightType::bf16;
  std::string commit;             // this program's commit, for the metadata
  bool average = false;           // export averaged weights, which some checkpoints contain
  std::optional<ImageSize> size;  // k times the policy's size, with an integer k
  std::vector<int> channels;      // channels for widened_policy(); empty: unchanged
};

/// Reads a policy file, and writes it to `out` as write_policy() does. options.size also scales patches and minimum
/// line widths (policy/patch_spread.h); options.channels widens convolutions (policy/wider_convolutions.h). Throws
/// Error naming a file that cannot be read or written, or lacks the average that options.average selects. Throws
/// UsageError naming `size` or `channels` if the policy cannot have them.
ExportedPolicy export_policy(const std::string& policy_path, const std::string& out, const ExportOptions& options);

}  // namespace pictura
