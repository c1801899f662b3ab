// Driver under evaluation: a saved policy or a controller, with its device.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/results.h"
#include "pictura/policy/session_options.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

class PolicyController;
class PolicySession;
class Renderer;

/// A policy with its session's options, or a controller.
struct DriverOptions : SessionOptions {
  DriverOptions() { simulator = "auto"; }

  std::string checkpoint;
  // Controller that drives instead of the checkpoint's policy, see make_controller(). The checkpoint still defines the
  // world; without a checkpoint, the world is the paper's.
  std::string controller;
  // Creates the calling program's own controller, named `controller`. It runs on the host and reads vector
  // observations. The last argument is null without cameras (rig, or width_px and height_px). With cameras, it is a
  // renderer that has them and holds the simulator's maps.
  std::function<std::unique_ptr<Controller>(const DriverOptions&, const Simulator&, Renderer*)> make_own_controller;
  bool argmax = true;
  uint64_t seed = 1;
};

/// Visits all options of a driver except `checkpoint` and `controller`.
template <typename Visitor>
void visit_options(DriverOptions& options, Visitor&& v) {
  v.value({"argmax"}, options.argmax);
  v.value({"seed"}, options.seed);
  visit_options(static_cast<SessionOptions&>(options), v);
}

/// Controller of a batch of worlds, and the number of agents that its last act() drove.
struct Driving {
  std::unique_ptr<Controller> controller;
  std::function<int64_t()> num_driven;
};

int64_t count_active(Simulator& simulator);
/// Creates a controller that drives with a session's policy, and the options' argmax and seed. A policy trained without
/// auxiliary slots (observed numbers that no image shows) reads zeros there.
std::unique_ptr<PolicyController> policy_controller(PolicySession& session, Renderer* renderer,
                                                    const DriverOptions& options, const Simulator& simulator);

/// Driver under evaluation. Its session, renderer and options must outlive it.
struct EvaluatedDriver {
  SimulatorConfig world;      // fixed conditioning and lights, no early end of episodes (paper)
  EvaluationSetting setting;  // the driver's part of the setting
  Device device;
  std::function<Driving(Simulator&)> drive;
};

/// Returns a session's part of the setting: policy, precision, device and images.
EvaluationSetting setting_of(const PolicySession& session);

/// steps: length of an episode.
EvaluatedDriver policy_driver(PolicySession* session, Renderer* renderer, const DriverOptions& options, int steps);
EvaluatedDriver controller_driver(const DriverOptions& options, int steps);

}  // namespace pictura
