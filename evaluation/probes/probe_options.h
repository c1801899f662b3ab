// Options of all probes. In a probe, policies drive worlds, and the probe measures how policies respond to changes of
// the worlds' states. Includes no torch headers.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/common/support/named_option.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

struct ProbeOptions {
  ProbeOptions() {
    worlds.densities = {Density::medium};
    worlds.scenarios = 0;
    worlds.steps = 600;  // one minute; most agents still drive at its end
  }

  // Worlds, devices and progress callback. Only the first of `densities` is used. `first_scenario` and `scenarios`
  // select the scenes (scenarios 0: default_probe_scenes()). Each policy drives an equal number of scenes: the first
  // policy the first range, and so on. The policies are those of `policies`, not `checkpoint`.
  EvaluateOptions worlds;
  std::vector<std::string> policies;  // files (checkpoints or safetensors), or names of policies of the calling program
  // Element i creates the session of policies[i] if the calling program supplies this policy. It is empty for a file,
  // and may be missing if only files follow.
  std::vector<std::function<std::unique_ptr<PolicySession>(const DriverOptions&)>> make_own_policies;
  int sample_steps = 10;  // number of steps between sampled states
  int batch = 4096;  // cases computed together, rounded up to whole passes of a network; affects only memory and time
};

/// Visits the options of all probes except policies, worlds and devices.
template <typename Visitor>
void visit_options(ProbeOptions& probe, Visitor&& v) {
  EvaluateOptions& worlds = probe.worlds;
  v.choice({"density", "--density", "light, medium or dense: 60, 120 or 150 agents per world"},
           worlds.densities.front(), kDensityNames);
  v.value({"scenes", "--scenes",
           "Number of driven scenarios, divided equally among the policies; default: the same number for each map and "
           "policy, at least two per map",
           1},
          worlds.scenarios);
  v.value({"first_scene", "--first-scene", "Number of the first scenario", 0}, worlds.first_scenario);
  v.value({"sample_steps", "--every", "Steps between sampled states", 1}, probe.sample_steps);
  v.value({"batch", "--batch",
           "Number of cases that are computed together, rounded up to whole passes of the network; affects only memory "
           "and time",
           1, 1 << 20},
          probe.batch);
}

/// Number of cases in every pass through a network. A case has two inputs: with and without its road user. They take
/// the same row in two separate passes, so that equal inputs give bit-identical outputs.
constexpr int probe_pass(Device device) { return device.is_host() ? 256 : 2048; }

/// Returns the default number of scenes: each policy drives equally many on each map, and each map has two scenes or
/// more.
int default_probe_scenes(size_t num_policies, size_t num_maps);

}  // namespace pictura
