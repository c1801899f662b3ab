// Removed keys, which old configurations may contain. Each has only one valid value, which matches the current
// behaviour.
#pragma once

#include <array>

namespace pictura {

struct RemovedKey {
  const char *name, *value, *reason;  // value as both TOML and JSON write it
};

inline constexpr std::array kRemovedKeys{
    RemovedKey{"simulator.dynamics.forbid_reversing", "false",
               "the rule was removed, since policies learn nothing with it: docs/research/experiments.md"},
    RemovedKey{"policy.goal_features", "false", "distances to goals were removed: docs/research/experiments.md"},
    RemovedKey{"policy.critic_layers", "0", "separate trunks of the critic were removed: docs/research/experiments.md"},
    RemovedKey{"policy.value_head", "\"linear\"", "other heads were removed: docs/research/experiments.md"},
};

}  // namespace pictura
