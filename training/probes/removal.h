// Counterfactual removal (paper, "Counterfactual probes reveal visual grounding"): what policies make of a state with
// and without one of its road users, by how much of that user the ego's cameras could see. Without torch headers.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/training/evaluation/evaluate.h"
#include "pictura/training/probes/removal_results.h"

namespace pictura {

struct RemovalOptions {
  // The worlds and who computes: maps, the first of `densities` or agents_per_world, steps, argmax, seed, devices,
  // conditioning, progress. `first_scenario` and `scenarios` are the scenes, of which each policy drives as many, one
  // range after the other. Who is evaluated is below.
  EvaluateOptions worlds;
  std::vector<std::string> policies;  // checkpoints or safetensors
  int64_t removals = 88'000;          // in all, as many in each scene; fewer where a scene has not as many
  int sample_steps = 10;              // states are sampled every so many steps
  float range_m = 50;                 // users that are farther away are not hidden
  RemovalControl control = RemovalControl::none;
  int batch = 4096;  // cases in a call, rounded up to whole passes; changes memory and time alone
};

/// Cases that go through a network at once, always, with and without their user at the same places of two passes: equal
/// inputs give equal bits.
constexpr int removal_pass(Device device) { return device.is_host() ? 256 : 2048; }

/// Steps of a scene unless others are asked for: a minute, in which most agents still drive.
constexpr int kRemovalSteps = 600;

/// As many scenes as give each policy the same number of them on each map, and each map two or more.
int default_removal_scenes(size_t num_policies, size_t num_maps);

/// Drives evaluation worlds, those of evaluate() with the same numbers, in the world of the first policy: its
/// population, walls and conditioning, which are put to all. In states of every `sample_steps` steps, pairs are drawn
/// of an active vehicle, the ego, and another active or halted agent within range_m, the user, none twice; parked cars
/// are no users. Each policy is given what it reads of the state, as it is and with the user hidden from this ego: for
/// vectors Simulator::observe, for images a view that leaves it out. Images are those that each policy was trained
/// with; occlusion is measured in the cameras of the first that reads images, or in the paper's. ^C ends it with the
/// cases that are done. Throws UsageError where scenes cannot be shared equally, Error naming file and key for bad
/// input.
RemovalResults probe_removal(const RemovalOptions& options);
/// The same of policies that are open, of one device, whose renderers and cameras are kept; options.policies names
/// them.
RemovalResults probe_removal(const std::vector<PolicySession*>& sessions, const RemovalOptions& options);

}  // namespace pictura
