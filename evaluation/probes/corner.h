// Blind corners (paper, "Closed-loop driving reveals occlusion-aware behavior"): how policies drive on towards a corner
// from which a vehicle comes that walls hide, and towards ones like it where nobody comes. Without torch headers.
#pragma once

#include "pictura/evaluation/probes/corner_results.h"
#include "pictura/evaluation/probes/probe_options.h"

namespace pictura {

class PolicySession;

struct CornerOptions : ProbeOptions {
  CornerOptions() {
    sample_steps = 5;
    batch = 256;
    worlds.adds_walls = true;  // they make the corners blind
  }
  int64_t pairs = 200;  // in all, from all scenes in turn; fewer where so many are not found
  CornerSearch search;
  CornerControl control = CornerControl::none;
};

/// Drives evaluation worlds as probe_removal() does, or has options.worlds.controller drive all of them, and looks in
/// their states for egos before blind corners (find_corner_states()). Kept are those in which nothing of who is hidden
/// is seen (Renderer::visibility, in the cameras of the first policy that reads images, or in the paper's), who enters
/// the junction within kTakeoverSteps; and of both kinds those after which the scene goes on for so long. Pairs are
/// match_corners(). From each state each policy drives the ego for kTakeoverSteps (TakeoverWorlds), in worlds with
/// walls and without: with who is hidden, without, and from the empty corner. `batch` pairs are run at once. ^C ends it
/// with the pairs that are done. Throws UsageError where scenes cannot be shared equally, Error naming file and key for
/// bad input.
CornerResults probe_corner(const CornerOptions& options);
/// The same of policies that are open, of one device, whose renderers and cameras are kept; options.policies names
/// them.
CornerResults probe_corner(const std::vector<PolicySession*>& sessions, const CornerOptions& options);

}  // namespace pictura
