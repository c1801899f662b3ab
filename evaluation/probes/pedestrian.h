// Probe of a tracked pedestrian (paper, "Counterfactual probes reveal visual grounding"). It measures, in frozen
// states, policies' responses to a pedestrian that emerges from behind a vehicle and is hidden again.
#pragma once

#include "pictura/evaluation/probes/pedestrian_results.h"
#include "pictura/evaluation/probes/probe_options.h"

namespace pictura {

class PolicySession;

struct PedestrianOptions : ProbeOptions {
  int64_t paths = 32;        // maximum; divided evenly among scenes
  float hider_range_m = 30;  // maximum distance of the hiding vehicle
  float min_speed_mps = 1;   // forward speed of the ego
  // Height of the pedestrian, a child. Vehicles are 1.5 m high, so they can hide it from all cameras.
  float height_m = 1.2f;
  PedestrianControl control = PedestrianControl::none;
};

template <typename Visitor>
void visit_options(PedestrianOptions& options, Visitor&& v) {
  visit_options(static_cast<ProbeOptions&>(options), v);
  v.value({"paths", "--paths", "Total number of paths, each in one state and with one figure", 1}, options.paths);
  v.value({"hider_range_m", "--range", "Maximum distance in m from the ego to the vehicle behind which a path begins",
           6, 1000},
          options.hider_range_m);
  v.value({"min_speed_mps", "--min-speed", "Minimum forward speed of the ego in m/s", -100, 100},
          options.min_speed_mps);
  v.value({"height_m", "--height", "Height of the pedestrian in m; vehicles are 1.5 m high", 0.1, 3}, options.height_m);
  v.choice({.name = "control",
            .flag = "--control",
            .help = "Control experiment: unchanged shows no pedestrian; untrained uses policies with random weights in "
                    "the same states",
            .renamed = kRenamedControl},
           options.control, kPedestrianControlNames);
}

/// Drives evaluation worlds as probe_removal() does, and searches their states for paths. A path begins behind a hider:
/// a vehicle or parked car ahead of the ego, within hider_range_m (paths_behind(), usable_part()). The pedestrian is
/// placed on each point of the path. Each policy gets inputs with and without it: vectors from Simulator::observe,
/// images from the scene. Visibility is measured by ProbeRun::visibility(). Interrupts and errors are as for
/// probe_removal().
PedestrianResults probe_pedestrian(const PedestrianOptions& options);
/// Probes policies that are open on one device, see probe_removal().
PedestrianResults probe_pedestrian(const std::vector<PolicySession*>& sessions, const PedestrianOptions& options);

}  // namespace pictura
