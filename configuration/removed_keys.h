// Keys of configurations that earlier versions wrote and that are no more, each with the one value that still has a
// meaning: what holds without the key.
#pragma once

#include <array>

namespace pictura {

struct RemovedKey {
  const char *name, *value, *reason;  // the value as TOML and JSON both write it
};

inline constexpr std::array kRemovedKeys{
    RemovedKey{"simulator.dynamics.forbid_reversing", "false",
               "the rule was removed, since nothing is learnt with it: docs/research/experiments.md"},
    RemovedKey{"policy.goal_features", "false", "distances to goals were removed: docs/research/experiments.md"},
    RemovedKey{"policy.critic_layers", "0", "trunks of the critic's own were removed: docs/research/experiments.md"},
    RemovedKey{"policy.value_head", "\"linear\"", "other heads were removed: docs/research/experiments.md"},
};

}  // namespace pictura
