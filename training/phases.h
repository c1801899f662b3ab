// Phases of an update.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pictura {

/// Phase of an update; the rest of the wall time belongs to none. simulate: the simulator; render: all images; forward:
/// the network in rollouts; learn: the network and losses in updates; diagnose: gradients of single losses for the log;
/// backward: gradients of the total loss; optimize: the optimizer.
enum class Phase : uint8_t { simulate, render, forward, learn, diagnose, backward, optimize };
constexpr size_t kNumPhases = 7;
constexpr const char* kPhaseNames[kNumPhases] = {"simulate", "render",   "forward", "learn",
                                                 "diagnose", "backward", "optimize"};
using PhaseSeconds = std::array<double, kNumPhases>;

}  // namespace pictura
