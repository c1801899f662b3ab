// Compares two configurations, and decides which differences matter.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the key and both values of the first difference that a resumed run must not have, or an empty text. Keys
/// that visit_keys.h marks with Resume::free or Resume::reported may differ. render.backend may differ if both
/// renderers draw identical images. All keys of [render] may differ if the policy reads no images. The paths of rigs
/// and backbones may differ, so compare the rigs and the hashes of the backbones separately.
std::string first_difference(const Config& saved, const Config& now);

/// Returns the key and both values of the first setting in which two ranks (processes) of a run differ, or an empty
/// text. Devices and numbers of threads may differ.
std::string first_difference_of_ranks(const Config& first, const Config& other);

/// Returns the differences that a resumed run may have but should report (Resume::reported), as "KEY: OLD became NEW".
/// They include the schedules of learning rate and image size, and the teacher. RunKeeper::begin() reports a change of
/// the optimizer.
std::vector<std::string> differences_to_report(const Config& saved, const Config& now);

/// Returns the keys that evaluations use (Evaluation::counts), with their values as in to_toml(). They are keys of the
/// worlds, and keys of the policy if has_policy.
std::map<std::string, std::string> keys_of_evaluation(const Config& config, bool has_policy);

}  // namespace pictura
