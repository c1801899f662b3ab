// What all probes are asked: which worlds, driven and answered by which policies. Without torch headers.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/support/named_option.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

struct ProbeOptions {
  ProbeOptions() {
    worlds.densities = {Density::medium};
    worlds.scenarios = 0;
    worlds.steps = 600;  // a minute, in which most agents still drive
  }

  // The worlds and who computes: maps, the first of `densities` or agents_per_world, steps, argmax, seed, devices,
  // conditioning, progress. `first_scenario` and `scenarios` are the scenes, of which each policy drives as many, one
  // range after the other; 0: default_probe_scenes(). Who is evaluated is below.
  EvaluateOptions worlds;
  std::vector<std::string> policies;  // checkpoints or safetensors
  int sample_steps = 10;              // states are sampled every so many steps
  int batch = 4096;                   // cases in a call, rounded up to whole passes; changes memory and time alone
};

/// Visits the options of all probes beside policies, worlds and devices.
template <typename Visitor>
void visit_options(ProbeOptions& probe, Visitor&& v) {
  EvaluateOptions& worlds = probe.worlds;
  v.choice({"density", "--density", "light, medium or dense: 60, 120 or 150 agents a world"}, worlds.densities.front(),
           kDensityNames);
  v.value({"scenes", "--scenes",
           "Scenarios that are driven, an equal share by each policy; default: as many on each map for each policy, "
           "two a map or more",
           1},
          worlds.scenarios);
  v.value({"first_scene", "--first-scene", "The number of the first scenario", 0}, worlds.first_scenario);
  v.value({"sample_steps", "--every", "Steps between sampled states", 1}, probe.sample_steps);
  v.value({"batch", "--batch",
           "Cases in a call, rounded up to whole passes of a network; changes memory and time alone", 1, 1 << 20},
          probe.batch);
}

/// Cases that go through a network at once, always, with and without whom they are about at the same places of two
/// passes: equal inputs give equal bits.
constexpr int probe_pass(Device device) { return device.is_host() ? 256 : 2048; }

/// As many scenes as give each policy the same number of them on each map, and each map two or more.
int default_probe_scenes(size_t num_policies, size_t num_maps);

}  // namespace pictura
