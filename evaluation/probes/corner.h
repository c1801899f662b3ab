// Probe of blind corners (paper, "Closed-loop driving reveals occlusion-aware behavior"). It compares how policies
// approach corners with and without a hidden vehicle.
#pragma once

#include "pictura/evaluation/probes/corner_results.h"
#include "pictura/evaluation/probes/probe_options.h"

namespace pictura {

class PolicySession;

struct CornerOptions : ProbeOptions {
  CornerOptions() {
    sample_steps = 5;
    batch = 256;
    worlds.adds_walls = true;
  }
  int64_t pairs = 200;  // maximum; pairs are taken from all scenes in turn
  CornerSearch search;
  CornerControl control = CornerControl::none;
};

template <typename Visitor>
void visit_options(CornerOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  CornerSearch& search = options.search;
  v.value({"pairs", "--pairs", "Total number of pairs of a corner with a hidden vehicle and a similar empty corner", 1},
          options.pairs);
  v.value(
      {"max_distance_m", "--max-distance",
       "Maximum distance in m from the ego to the corner when a policy takes over; more than 8", 8.1, kCornerLead_m},
      search.max_distance_m);
  v.value({"min_speed_mps", "--min-speed",
           "Minimum forward speed in m/s of the ego at the takeover, and of the hidden vehicle", -100, 100},
          search.min_speed_mps);
  v.value(
      {"user_range_m", "--range", "Maximum distance in m from the hidden vehicle to the junction", 1, kCornerLead_m},
      search.user_range_m);
  v.name({"driver", "--driver", "Driver instead of the policies before the takeovers: lane (follows lanes)"},
         options.worlds.controller, {"lane"});
  v.choice({"control", "--control",
            "Control experiment: permuted removes another vehicle near the ego instead of the hidden vehicle; "
            "untrained uses policies with random weights in the same states"},
           options.control, kCornerControlNames);
}

/// Drives evaluation worlds as probe_removal() does, or with options.worlds.controller. Searches their states for egos
/// (vehicles to be taken over) before blind corners, see find_corner_states(). A hidden vehicle must enter the junction
/// within kTakeoverSteps, and the ego must see no part of it (ProbeRun::visibility()). The scene must last
/// kTakeoverSteps after the state. match_corners() pairs states with and without a hidden vehicle. Each policy then
/// drives the ego for kTakeoverSteps (TakeoverWorlds) from each CornerCase, in worlds with and without walls. `batch`
/// pairs run together. Interrupts and errors are as for probe_removal().
CornerResults probe_corner(const CornerOptions& options);
/// Probes policies that are open on one device, see probe_removal().
CornerResults probe_corner(const std::vector<PolicySession*>& sessions, const CornerOptions& options);

}  // namespace pictura
