// Driver under evaluation: a saved policy or a controller, with its device. It drives in worlds of any kind. Includes
// no torch headers.
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

/// Options of a driver: a policy and how it is opened, or a controller.
struct DriverOptions : SessionOptions {
  DriverOptions() { simulator = "auto"; }

  std::string checkpoint;
  // Controller that drives instead of the checkpoint's policy: a name known to make_controller(), for instance "lane".
  // The world's configuration is the checkpoint's; without a checkpoint it is the paper's.
  std::string controller;
  // Creates a controller that the calling program supplies; `controller` is then its name. The controller runs on the
  // host and reads vector observations. If the options define cameras (rig, or width_px and height_px), the last
  // argument is a renderer that has these cameras and holds the simulator's maps. Without cameras it is null.
  std::function<std::unique_ptr<Controller>(const DriverOptions&, const Simulator&, Renderer*)> make_own_controller;
  bool argmax = true;
  uint64_t seed = 1;
};

/// Visits the options of a driver except `checkpoint` and `controller`.
template <typename Visitor>
void visit_options(DriverOptions& options, Visitor&& v) {
  v.value({"argmax"}, options.argmax);
  v.value({"seed"}, options.seed);
  visit_options(static_cast<SessionOptions&>(options), v);
}

/// Controller of the agents in a batch of worlds. num_driven() returns the number of agents that the controller drove
/// in its last act().
struct Driving {
  std::unique_ptr<Controller> controller;
  std::function<int64_t()> num_driven;
};

/// Returns the number of active agents in all worlds.
int64_t count_active(Simulator& simulator);
/// Creates a controller by which a session's policy drives in a simulator, with the options' argmax and seed. A policy
/// that was trained without auxiliary slots (observed numbers that no image shows) reads zeros in these slots even if
/// the simulator fills them.
std::unique_ptr<PolicyController> policy_controller(PolicySession& session, Renderer* renderer,
                                                    const DriverOptions& options, const Simulator& simulator);

/// Driver under evaluation. The session, renderer and options from which it was created must outlive it.
struct EvaluatedDriver {
  SimulatorConfig world;      // the paper's evaluation world: fixed conditioning and lights, no early end of episodes
  EvaluationSetting setting;  // the driver's part of the setting
  Device device;
  std::function<Driving(Simulator&)> drive;
};

/// Returns the part of an evaluation's setting that a session determines: policy, precision, device and images.
EvaluationSetting setting_of(const PolicySession& session);

/// Creates the driver of a session's policy, for episodes of `steps` steps.
EvaluatedDriver policy_driver(PolicySession* session, Renderer* renderer, const DriverOptions& options, int steps);
/// Creates the driver of options.controller, which needs no policy.
EvaluatedDriver controller_driver(const DriverOptions& options, int steps);

}  // namespace pictura
