// Counterfactual removal (paper, "Counterfactual probes reveal visual grounding"): responses of policies to a state
// with and without one of the state's road users, grouped by how much of that user the ego's cameras show. Has no torch
// headers.
#pragma once

#include <vector>

#include "pictura/evaluation/probes/probe_options.h"
#include "pictura/evaluation/probes/removal_results.h"

namespace pictura {

class PolicySession;

struct RemovalOptions : ProbeOptions {
  int64_t removals = 88'000;  // total number, equal in each scene; smaller if a scene has fewer
  float range_m = 50;         // maximum distance of the removed users
  RemovalControl control = RemovalControl::none;
};

template <typename Visitor>
void visit_options(RemovalOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  v.value({"removals", "--removals", "Total number of cases: one user hidden for one ego in one state", 1},
          options.removals);
  v.value({"range_m", "--range", "Maximum distance of a user, m", 1, 1000}, options.range_m);
  v.choice({"control", "--control",
            "Control: nobody hides no user; permuted hides another of the ego's users, redrawn for each case; "
            "untrained uses policies with fresh weights in the same states"},
           options.control, kRemovalControlNames);
}

/// Drives evaluation worlds, which are those of evaluate() with the same numbers, in the world configuration of the
/// first policy: its population, walls and conditioning apply to all policies. Every `sample_steps` steps it draws
/// distinct pairs from the state: the ego, an active vehicle, and the user, another active or halted agent within
/// range_m. Parked cars are not drawn as users.
/// Each policy gets its input of the unchanged state, and its input with the user hidden from this ego: vectors by
/// Simulator::observe, images by a view without the user. Each policy reads images as in its training; occlusion is
/// measured in the cameras of the first policy that reads images, or in the paper's cameras. An interrupt ends the
/// probe with the completed cases. Throws UsageError if scenes cannot be shared equally, Error naming file and key for
/// bad input.
RemovalResults probe_removal(const RemovalOptions& options);
/// Probes open policies of one device, with their renderers and cameras; options.policies names them.
RemovalResults probe_removal(const std::vector<PolicySession*>& sessions, const RemovalOptions& options);

}  // namespace pictura
