// Who is evaluated, in whatever worlds: a saved policy or a controller, and where it computes. Without torch headers.
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

/// Who drives: a policy, and how it is opened, or a controller.
struct DriverOptions : SessionOptions {
  DriverOptions() { simulator = "auto"; }

  std::string checkpoint;
  // A controller of make_controller, "lane" for one, that drives instead of the checkpoint's policy, in its world, or
  // in the paper's if there is no checkpoint.
  std::string controller;
  // Makes the controller of that name where a program brings its own. It drives on the host and reads vectors. Where
  // the options name cameras (rig, or width_px and height_px), it reads their images, too: drawn by the renderer, which
  // holds the simulator's maps. Without cameras the renderer is null.
  std::function<std::unique_ptr<Controller>(const Simulator&, Renderer*)> make_own_controller;
  bool argmax = true;
  uint64_t seed = 1;
};

/// Visits the options of a driver, but for its name.
template <typename Visitor>
void visit_options(DriverOptions& options, Visitor&& v) {
  v.value({"argmax"}, options.argmax);
  v.value({"seed"}, options.seed);
  visit_options(static_cast<SessionOptions&>(options), v);
}

/// What drives the agents of a batch of worlds, and how many it drove when it last acted.
struct Driving {
  std::unique_ptr<Controller> controller;
  std::function<int64_t()> num_driven;
};

/// How many agents of all worlds are active.
int64_t count_active(Simulator& simulator);
/// A session's policy in a simulator, by argmax and seed of the options. Where the simulator fills auxiliary slots, a
/// policy that was trained without them gets zeros, as in training.
std::unique_ptr<PolicyController> policy_controller(PolicySession& session, Renderer* renderer,
                                                    const DriverOptions& options, const Simulator& simulator);

/// What it drives with lives as long as session, renderer and options do.
struct EvaluatedDriver {
  SimulatorConfig world;      // the paper's evaluation: fixed conditioning and lights, no early end
  EvaluationSetting setting;  // what of it is the driver's
  Device device;
  std::function<Driving(Simulator&)> drive;
};

/// What of an evaluation's setting is the session's: policy, precision, device and images.
EvaluationSetting setting_of(const PolicySession& session);

/// A session's policy, in episodes of so many steps.
EvaluatedDriver policy_driver(PolicySession* session, Renderer* renderer, const DriverOptions& options, int steps);
/// options.controller, which needs no policy.
EvaluatedDriver controller_driver(const DriverOptions& options, int steps);

}  // namespace pictura
