// Counterfactual removal (paper, "Counterfactual probes reveal visual grounding"): what policies make of a state with
// and without one of its road users, by how much of that user the ego's cameras could see. Without torch headers.
#pragma once

#include <vector>

#include "pictura/evaluation/probes/probe_options.h"
#include "pictura/evaluation/probes/removal_results.h"

namespace pictura {

class PolicySession;

struct RemovalOptions : ProbeOptions {
  int64_t removals = 88'000;  // in all, as many in each scene; fewer where a scene has not as many
  float range_m = 50;         // users that are farther away are not hidden
  RemovalControl control = RemovalControl::none;
};

template <typename Visitor>
void visit_options(RemovalOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  v.value({"removals", "--removals", "Cases in all: one user hidden for one ego in one state", 1}, options.removals);
  v.value({"range_m", "--range", "How far away a user may be, m", 1, 1000}, options.range_m);
  v.choice({"control", "--control",
            "A control: nobody hides no one; permuted hides another of the ego's users, drawn anew for each case; "
            "untrained has policies with fresh weights answer in the same states"},
           options.control, kRemovalControlNames);
}

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
