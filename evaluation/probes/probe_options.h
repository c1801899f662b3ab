// What all probes are asked: which worlds, driven and answered by which policies. Without torch headers.
#pragma once

#include <string>
#include <vector>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

struct ProbeOptions {
  // The worlds and who computes: maps, the first of `densities` or agents_per_world, steps, argmax, seed, devices,
  // conditioning, progress. `first_scenario` and `scenarios` are the scenes, of which each policy drives as many, one
  // range after the other. Who is evaluated is below.
  EvaluateOptions worlds;
  std::vector<std::string> policies;  // checkpoints or safetensors
  int sample_steps = 10;              // states are sampled every so many steps
  int batch = 4096;                   // cases in a call, rounded up to whole passes; changes memory and time alone
};

/// Cases that go through a network at once, always, with and without whom they are about at the same places of two
/// passes: equal inputs give equal bits.
constexpr int probe_pass(Device device) { return device.is_host() ? 256 : 2048; }

/// Steps of a scene unless others are asked for: a minute, in which most agents still drive.
constexpr int kProbeSteps = 600;

/// As many scenes as give each policy the same number of them on each map, and each map two or more.
int default_probe_scenes(size_t num_policies, size_t num_maps);

}  // namespace pictura
