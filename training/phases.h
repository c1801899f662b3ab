// Phases into which the time of an update is divided.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pictura {

/// Phase of an update. simulate: the simulator's steps; render: images, wherever they are needed; forward: the network
/// in rollouts; learn: the network and its losses in updates; diagnose: gradients of single losses, for the log only;
/// backward: gradients of the loss that is minimised; optimize: the optimizer's steps. The rest of the wall time
/// belongs to no phase.
enum class Phase : uint8_t { simulate, render, forward, learn, diagnose, backward, optimize };
constexpr size_t kNumPhases = 7;
constexpr const char* kPhaseNames[kNumPhases] = {"simulate", "render",   "forward", "learn",
                                                 "diagnose", "backward", "optimize"};
using PhaseSeconds = std::array<double, kNumPhases>;

}  // namespace pictura
