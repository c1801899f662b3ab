// Blind corners (paper, "Closed-loop driving reveals occlusion-aware behavior"): how policies approach a corner from
// which a vehicle hidden by walls comes, and similar corners from which no vehicle comes. Has no torch headers.
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
  int64_t pairs = 200;  // total number, taken from all scenes in turn; smaller if fewer are found
  CornerSearch search;
  CornerControl control = CornerControl::none;
};

template <typename Visitor>
void visit_options(CornerOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  CornerSearch& search = options.search;
  v.value({"pairs", "--pairs", "Total number of pairs: a corner with a hidden vehicle, and an empty corner", 1},
          options.pairs);
  v.value({"max_distance_m", "--max-distance",
           "Maximum distance before the corner at which a policy takes over, m; at least 8 m", 8.1, kCornerLead_m},
          search.max_distance_m);
  v.value({"min_speed_mps", "--min-speed",
           "Minimum forward speed of the ego at the takeover and of the hidden vehicle, m/s", -100, 100},
          search.min_speed_mps);
  v.value(
      {"user_range_m", "--range", "Maximum distance of the hidden vehicle before the junction, m", 1, kCornerLead_m},
      search.user_range_m);
  v.name({"driver", "--driver",
          "Driver of the scenes in which policies take over, instead of the policies: lane, the lane keeper"},
         options.worlds.controller, {"lane"});
  v.choice({"control", "--control",
            "Control: permuted removes another vehicle near the ego instead of the hidden vehicle; untrained uses "
            "policies with fresh weights in the same states"},
           options.control, kCornerControlNames);
}

/// Drives evaluation worlds as probe_removal() does, or lets options.worlds.controller drive all of them, and searches
/// their states for egos before blind corners (find_corner_states()). A hidden state is kept if the vehicle enters the
/// junction within kTakeoverSteps and no part of it is visible. Visibility is measured by Renderer::visibility, in the
/// cameras of the first policy that reads images, or in the paper's cameras. States of both kinds are kept only if
/// their scene continues for kTakeoverSteps. match_corners() forms the pairs.
/// Each policy then drives the ego for kTakeoverSteps (TakeoverWorlds), in worlds with walls and without: from the
/// hidden state, from the hidden state without its vehicle, and from the empty corner. `batch` pairs run at once. An
/// interrupt ends the probe with the completed pairs. Throws UsageError if scenes cannot be shared equally, Error
/// naming file and key for bad input.
CornerResults probe_corner(const CornerOptions& options);
/// Probes open policies of one device, with their renderers and cameras; options.policies names them.
CornerResults probe_corner(const std::vector<PolicySession*>& sessions, const CornerOptions& options);

}  // namespace pictura
