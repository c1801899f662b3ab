// The tracked pedestrian (paper, "Counterfactual probes reveal visual grounding"): what policies make of a pedestrian
// who comes out from behind a vehicle and is hidden again, in states that stand still. Without torch headers.
#pragma once

#include "pictura/evaluation/probes/pedestrian_results.h"
#include "pictura/evaluation/probes/probe_options.h"

namespace pictura {

class PolicySession;

struct PedestrianOptions : ProbeOptions {
  int64_t paths = 32;        // in all, as many in each scene; fewer where none are found
  float hider_range_m = 30;  // vehicles that are farther away hide no path
  float min_speed_mps = 1;   // of the ego, forwards
  // Of the pedestrian: a child's. Behind the world's vehicles, which are 1.5 m high, its own pedestrians of 1.7 m are
  // never wholly hidden from cameras above these.
  float height_m = 1.2f;
  PedestrianControl control = PedestrianControl::none;
};

template <typename Visitor>
void visit_options(PedestrianOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  v.value({"paths", "--paths", "Paths in all, each through one state; each has a figure", 1}, options.paths);
  v.value({"hider_range_m", "--range", "How far away the vehicle that a path begins behind may be, m", 6, 1000},
          options.hider_range_m);
  v.value({"min_speed_mps", "--min-speed", "Of the ego, forwards, m/s", -100, 100}, options.min_speed_mps);
  v.value({"height_m", "--height", "Of the pedestrian, m; vehicles are 1.5 m high", 0.1, 3}, options.height_m);
  v.choice({"control", "--control",
            "A control: nobody puts no pedestrian there; untrained has policies with fresh weights answer in the same "
            "states"},
           options.control, kPedestrianControlNames);
}

/// Drives evaluation worlds as probe_removal() does, and looks in their states for paths that nobody has drawn by hand:
/// an active vehicle, the ego; a vehicle or parked car ahead of it, the hider, within hider_range_m; and one of
/// paths_behind() it, along which a pedestrian is wholly hidden, seen, and wholly hidden again (used_part()), first by
/// the hider. The pedestrian is put on each point of it, the state is otherwise as it was, and each policy is given
/// what it reads with and without it: for vectors Simulator::observe, for images a scene with its box. Visibility is
/// measured, and paths are chosen, in the cameras of the first policy that reads images, or in the paper's. ^C ends it
/// with the cases that are done. Throws UsageError where scenes cannot be shared equally, Error naming file and key for
/// bad input.
PedestrianResults probe_pedestrian(const PedestrianOptions& options);
/// The same of policies that are open, of one device, whose renderers and cameras are kept; options.policies names
/// them.
PedestrianResults probe_pedestrian(const std::vector<PolicySession*>& sessions, const PedestrianOptions& options);

}  // namespace pictura
