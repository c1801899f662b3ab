// Exports a policy as a safetensors file, for releases and other tools. Includes no torch headers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "pictura/common/image.h"

namespace pictura {

/// Type of the weights in a file.
enum class WeightType {
  f32,   // unchanged
  bf16,  // rounded to 8 significant bits, which halves the file size
};

struct ExportedPolicy {
  int64_t parameters = 0, file_bytes = 0;
  int64_t updates = 0, agent_steps = 0;  // counters of the training run
  std::string policy_hash;               // hash of the weights in the file
};

/// Options of an export.
struct ExportOptions {
  WeightType weights = WeightType::bf16;
  std::string commit;             // commit of the program, for the metadata
  bool average = false;           // export the average of weights, which some checkpoints contain
  std::optional<ImageSize> size;  // larger image size: k times the policy's width and height, with an integer k
};

/// Reads a policy from a checkpoint or a safetensors file and writes it to `out` as write_policy() does. With
/// options.size, patches and the minimum width of drawn lines become k times as large, and the first convolution is
/// spread over the larger patches (policy/patch_spread.h). Throws Error, which names the file, if a file cannot be read
/// or written, or has no average although options.average is set. Throws UsageError, which names `size`, if the policy
/// cannot have that size.
ExportedPolicy export_policy(const std::string& policy_path, const std::string& out, const ExportOptions& options);

}  // namespace pictura
