// Growth of a policy's convolutions to more channels.
#pragma once

#include <vector>

#include "pictura/policy/stored_policy.h"

namespace pictura {

/// Returns a policy with equal outputs, whose convolutions have `channels`: multiples of the policy's, and the last one
/// unchanged. New channels are copies. The weights behind a channel are divided between its copies in uneven shares, so
/// that the copies get different gradients. Throws UsageError naming `channels` if the policy cannot have them.
StoredPolicy widened_policy(const StoredPolicy& policy, const std::vector<int>& channels);

}  // namespace pictura
