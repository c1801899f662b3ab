// Probe of counterfactual removal (paper, "Counterfactual probes reveal visual grounding"). It measures responses of
// policies to a state with and without one of its road users, grouped by how much of that user the ego's cameras show.
// Includes no torch headers.
#pragma once

#include <vector>

#include "pictura/evaluation/probes/probe_options.h"
#include "pictura/evaluation/probes/removal_results.h"

namespace pictura {

class PolicySession;

struct RemovalOptions : ProbeOptions {
  int64_t removals = 88'000;  // maximum total number, divided evenly among scenes
  float range_m = 50;         // maximum distance of the removed users
  RemovalControl control = RemovalControl::none;
};

template <typename Visitor>
void visit_options(RemovalOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  v.value({"removals", "--removals",
           "Total number of cases; in a case, one road user is hidden from one ego in one state", 1},
          options.removals);
  v.value({"range_m", "--range", "Maximum distance in m from the ego to the road user", 1, 1000}, options.range_m);
  v.choice({"control", "--control",
            "Control experiment: nobody hides no road user; permuted hides a random other road user near the ego; "
            "untrained uses policies with random weights in the same states"},
           options.control, kRemovalControlNames);
}

/// Drives evaluation worlds, which equal the worlds of evaluate() with the same scenario numbers. The world
/// configuration is that of the first policy: its population, walls and conditioning apply to all policies. Every
/// `sample_steps` steps the probe draws distinct pairs of an ego and a user from the state. The ego is an active
/// vehicle; the user is another active or halted agent within range_m. Parked cars are never users. Each policy gets
/// two inputs: one of the unchanged state, and one with the user hidden from this ego. Vectors come from
/// Simulator::observe, images from a view with or without the user. Each policy reads images as in its training.
/// Occlusion is measured in the cameras of the first policy that reads images, or in the paper's cameras if no policy
/// reads images. An interrupt ends the probe with the completed cases. Throws UsageError if the number of scenes is not
/// a multiple of the number of policies. Throws Error naming file and key for bad input.
RemovalResults probe_removal(const RemovalOptions& options);
/// Probes policies that are already open on one device, with their renderers and cameras. options.policies holds their
/// names.
RemovalResults probe_removal(const std::vector<PolicySession*>& sessions, const RemovalOptions& options);

}  // namespace pictura
