// Probe of a tracked pedestrian (paper, "Counterfactual probes reveal visual grounding"). It measures, in frozen
// states, responses of policies to a pedestrian that emerges from behind a vehicle and is hidden again. Includes no
// torch headers.
#pragma once

#include "pictura/evaluation/probes/pedestrian_results.h"
#include "pictura/evaluation/probes/probe_options.h"

namespace pictura {

class PolicySession;

struct PedestrianOptions : ProbeOptions {
  int64_t paths = 32;        // maximum number in all scenes together, divided evenly among scenes
  float hider_range_m = 30;  // maximum distance of a vehicle that hides a path
  float min_speed_mps = 1;   // minimum speed of the ego, forwards
  // Height of the inserted pedestrian, a child. Vehicles are 1.5 m high, so they can hide a child from all cameras.
  // They cannot hide the world's other pedestrians, which are 1.7 m high, from cameras above 1.5 m.
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
  v.choice({"control", "--control",
            "Control experiment: nobody shows no pedestrian; untrained uses policies with random weights in the same "
            "states"},
           options.control, kPedestrianControlNames);
}

/// Drives evaluation worlds as probe_removal() does, and searches their states for paths. A path needs an ego, which is
/// an active vehicle, and a hider, which is a vehicle or parked car ahead of the ego within hider_range_m. The path is
/// one of those that paths_behind() returns for the hider. Along the path a pedestrian is first wholly hidden by the
/// hider, then seen, and then wholly hidden again (usable_part()). The pedestrian is placed on each point of the path
/// in the otherwise unchanged state. Each policy gets its input with and without the pedestrian: vectors from
/// Simulator::observe, images from a scene with the pedestrian's box. Visibility is measured in the cameras of the
/// first policy that reads images, or in the paper's cameras if no policy reads images. An interrupt ends the probe
/// with the completed cases. Throws UsageError if the number of scenes is not a multiple of the number of policies.
/// Throws Error naming file and key for bad input.
PedestrianResults probe_pedestrian(const PedestrianOptions& options);
/// Probes policies that are already open on one device, with their renderers and cameras. options.policies holds their
/// names.
PedestrianResults probe_pedestrian(const std::vector<PolicySession*>& sessions, const PedestrianOptions& options);

}  // namespace pictura
