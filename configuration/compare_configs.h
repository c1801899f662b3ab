// Comparison of configurations.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the first difference that a resumed run must not have (key and both values), or an empty text. Keys with
/// Resume::free or Resume::reported may differ. render.backend may differ if both renderers draw identical images.
/// [render] may differ if the policy reads no images. Callers must compare the contents of rigs and backbones.
std::string first_difference(const Config& saved, const Config& now);

/// Returns the first difference that ranks (processes) of a run must not have, in the same form.
std::string first_difference_of_ranks(const Config& first, const Config& other);

/// Returns the differences that a resumed run should report, as "KEY: OLD became NEW". A change of the optimizer is not
/// among them; RunKeeper::begin() reports it.
std::vector<std::string> differences_to_report(const Config& saved, const Config& now);

/// Returns the keys that evaluations use, with their values as in to_toml(). They include keys of the policy if
/// has_policy.
std::map<std::string, std::string> keys_of_evaluation(const Config& config, bool has_policy);

}  // namespace pictura
