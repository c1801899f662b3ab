// Driver under evaluation, in any worlds: a saved policy or a controller, and its device. Has no torch headers.
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
  // Name of a controller of make_controller(), for instance "lane", that drives instead of the checkpoint's policy. It
  // drives in the policy's world, or in the paper's world without a checkpoint.
  std::string controller;
  // Creates the controller if a program supplies its own; `controller` is then its name. The controller drives on the
  // host and reads vectors. If the options define cameras (rig, or width_px and height_px), the controller also reads
  // their images, drawn by its renderer, which holds the simulator's maps. Without cameras the renderer is null.
  std::function<std::unique_ptr<Controller>(const Simulator&, Renderer*)> make_own_controller;
  bool argmax = true;
  uint64_t seed = 1;
};

/// Visits the options of a driver except its name.
template <typename Visitor>
void visit_options(DriverOptions& options, Visitor&& v) {
  v.value({"argmax"}, options.argmax);
  v.value({"seed"}, options.seed);
  visit_options(static_cast<SessionOptions&>(options), v);
}

/// Controller of the agents in a batch of worlds, and the number of agents that it drove in its last act().
struct Driving {
  std::unique_ptr<Controller> controller;
  std::function<int64_t()> num_driven;
};

/// Number of active agents in all worlds.
int64_t count_active(Simulator& simulator);
/// Creates a controller of a session's policy in a simulator, with argmax and seed of the options. If the simulator
/// fills auxiliary slots, a policy that was trained without them reads zeros in these slots, as in training.
std::unique_ptr<PolicyController> policy_controller(PolicySession& session, Renderer* renderer,
                                                    const DriverOptions& options, const Simulator& simulator);

/// Driver under evaluation. Its `drive` needs the session, renderer and options that it was created from.
struct EvaluatedDriver {
  SimulatorConfig world;      // world of the paper's evaluation: fixed conditioning and lights, no early end
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
