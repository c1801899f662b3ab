// Probe of counterfactual removal (paper, "Counterfactual probes reveal visual grounding"). It measures policies'
// responses to a state with and without a road user, grouped by the user's occlusion.
#pragma once

#include <vector>

#include "pictura/evaluation/probes/probe_options.h"
#include "pictura/evaluation/probes/removal_results.h"

namespace pictura {

class PolicySession;

struct RemovalOptions : ProbeOptions {
  int64_t removals = 88'000;  // maximum; divided evenly among scenes
  float range_m = 50;         // maximum distance of removed users
  RemovalControl control = RemovalControl::none;
};

template <typename Visitor>
void visit_options(RemovalOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  v.value({"removals", "--removals",
           "Total number of cases; in a case, one road user is hidden from one ego in one state", 1},
          options.removals);
  v.value({"range_m", "--range", "Maximum distance in m from the ego to the road user", 1, 1000}, options.range_m);
  v.choice(
      {.name = "control",
       .flag = "--control",
       .help = "Control experiment: unchanged hides no road user; permuted hides a random other road user near the "
               "ego; untrained uses policies with random weights in the same states",
       .renamed = kRenamedControl},
      options.control, kRemovalControlNames);
}

/// Drives the worlds that evaluate() would drive with options.worlds. All worlds have the first policy's population,
/// walls and conditioning. Draws distinct pairs of an ego and a user every `sample_steps` steps. The ego is an active
/// vehicle; the user is another active or halted agent within range_m. Each policy gets two inputs, with and without
/// the user: vectors from Simulator::observe, images from a view. Occlusion is measured by ProbeRun::visibility(). An
/// interrupt ends the probe with the completed cases. Throws UsageError if the number of scenes is not a multiple of
/// the number of policies. Throws Error naming file and key for bad input.
RemovalResults probe_removal(const RemovalOptions& options);
/// Probes policies that are open on one device, with their renderers and cameras. options.policies names them.
RemovalResults probe_removal(const std::vector<PolicySession*>& sessions, const RemovalOptions& options);

}  // namespace pictura
