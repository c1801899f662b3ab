// Probe of blind corners (paper, "Closed-loop driving reveals occlusion-aware behavior"). It compares how policies
// approach two kinds of corners: those at which walls hide a crossing vehicle, and empty ones. Includes no torch
// headers.
#pragma once

#include "pictura/evaluation/probes/corner_results.h"
#include "pictura/evaluation/probes/probe_options.h"

namespace pictura {

class PolicySession;

struct CornerOptions : ProbeOptions {
  CornerOptions() {
    sample_steps = 5;
    batch = 256;
    worlds.adds_walls = true;  // walls make the corners blind
  }
  int64_t pairs = 200;  // maximum total number; pairs are taken from all scenes in turn
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

/// Drives evaluation worlds as probe_removal() does, or with options.worlds.controller in all worlds. Searches the
/// states of these worlds for egos (the vehicles to be taken over) that approach blind corners; see
/// find_corner_states(). A state with a hidden vehicle is kept if that vehicle enters the junction within
/// kTakeoverSteps and the ego sees no part of the vehicle. Renderer::visibility decides this, in the cameras of the
/// first policy that reads images, or in the paper's cameras if no policy reads images. All states, with and without a
/// hidden vehicle, are kept only if their scene lasts kTakeoverSteps more steps. Each pair of match_corners() is a
/// state with a hidden vehicle and a similar state without one. Each policy then drives the ego for kTakeoverSteps
/// (TakeoverWorlds) from three states: the state with the hidden vehicle, this state after removal of the vehicle, and
/// the similar state. Each run takes place in a world with walls and in a world without walls. `batch` pairs run
/// together. An interrupt ends the probe with the completed pairs. Throws UsageError if the number of scenes is not a
/// multiple of the number of policies. Throws Error naming file and key for bad input.
CornerResults probe_corner(const CornerOptions& options);
/// Probes policies that are already open on one device, with their renderers and cameras. options.policies holds their
/// names.
CornerResults probe_corner(const std::vector<PolicySession*>& sessions, const CornerOptions& options);

}  // namespace pictura
