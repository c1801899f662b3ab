#include "pictura/policy/export_policy.h"

#include <cmath>
#include <filesystem>

#include "pictura/common/error.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/policy/patch_spread.h"
#include "pictura/policy/stored_policy.h"
#include "pictura/policy/wider_convolutions.h"

namespace pictura {

namespace {

// Returns the policy for larger images: patches and line floor become larger by the same factor, and the first
// convolution is spread.
StoredPolicy resized_policy(const StoredPolicy& policy, ImageSize size) {
  const Config& config = policy.config;
  check_has_convolutions(policy, "size");
  if (!config.render.rig.empty()) {
    fail_usage("{}: size: its policy uses the cameras of {}, whose file gives the sizes", policy.path,
               config.render.rig);
  }
  const Camera& camera = policy.rig.cameras.at(0);
  const int factor = whole_factor({camera.width_px, camera.height_px}, size);
  if (factor == 0) {
    fail_usage("{}: size: expected an integer multiple of {}x{}, got {}x{}", policy.path, camera.width_px,
               camera.height_px, size.width_px, size.height_px);
  }
  StoredPolicy result = policy;
  result.config.policy.patch_px *= factor;
  // The product is rounded, so that 0.35 times 3 is 1.05 and not 1.0499999999999998.
  result.config.render.line_floor_px = std::round(1e6 * factor * config.render.line_floor_px) / 1e6;
  if (result.config.policy.patch_px > kMaxPatch_px || result.config.render.line_floor_px > kMaxLineFloor_px) {
    fail_usage("{}: size: expected patches of at most {} px and lines of at most {} px, got {} and {} for {}x{}",
               policy.path, kMaxPatch_px, kMaxLineFloor_px, result.config.policy.patch_px,
               result.config.render.line_floor_px, size.width_px, size.height_px);
  }
  result.config.render.width_px = size.width_px;
  result.config.render.height_px = size.height_px;
  result.config.render.schedule.clear();  // the schedule belongs to the run at the old size
  result.rig = paper_rig(size.width_px, size.height_px);
  StoredTensor& first = find_parameter(&result, kFirstConvolution);
  first = spread_over_patches(first, factor);
  if (factor > 1) result.rate_factors.try_emplace(kFirstConvolution, 1).first->second *= rate_factor_of_spread(factor);
  return result;
}

}  // namespace

ExportedPolicy export_policy(const std::string& policy_path, const std::string& out, const ExportOptions& options) {
  const StoredPolicy policy = read_stored_policy(policy_path, options.average);
  check_finite(policy.path, policy.parameters);
  StoredPolicy exported = options.size ? resized_policy(policy, *options.size) : policy;
  if (!options.channels.empty()) exported = widened_policy(exported, options.channels);
  write_stored_policy(out, exported, options.weights, options.commit);
  const StoredPolicy written = read_stored_policy(out);
  ExportedPolicy result;
  for (const StoredTensor& parameter : written.parameters)
    result.parameters += static_cast<int64_t>(parameter.values.size());
  result.file_bytes = static_cast<int64_t>(std::filesystem::file_size(out));
  result.updates = written.update;
  result.agent_steps = written.agent_steps;
  result.policy_hash = hash_of_parameters(written.parameters);
  return result;
}

}  // namespace pictura
