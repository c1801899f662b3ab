// Options of all probes, which measure how policies respond to changes of driven worlds.
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
    worlds.steps = 600;  // most agents still drive after one minute
  }

  // Worlds, devices and progress callback. Only the first density is used. `first_scenario` and `scenarios` select the
  // scenes (0: default_probe_scenes()). Each policy drives an equal consecutive range of scenes. `policies` replaces
  // `checkpoint`.
  EvaluateOptions worlds;
  std::vector<std::string> policies;  // files, or names of the calling program's policies
  // Element i creates the session of policies[i] if that is a policy of the calling program; empty for a file. Trailing
  // elements may be missing.
  std::vector<std::function<std::unique_ptr<PolicySession>(const DriverOptions&)>> make_own_policies;
  int sample_steps = 10;  // steps between sampled states
  int batch = 4096;       // cases computed together, rounded up to whole passes; changes no result
};

/// Old name of the control in which worlds are unchanged.
constexpr RenamedChoice kRenamedControl{"nobody", "unchanged"};

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

/// Cases per pass through a network. The two inputs of a case take the same row in two passes, so that equal inputs
/// give bit-identical outputs.
constexpr int probe_pass(Device device) { return device.is_host() ? 256 : 2048; }

/// Returns a number of scenes with which each policy drives each map equally often, and each map has at least two
/// scenes.
int default_probe_scenes(size_t num_policies, size_t num_maps);

}  // namespace pictura
