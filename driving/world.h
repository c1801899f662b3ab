// One world of one map, with its controller, by name or from a checkpoint.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/renderer.h"
#include "pictura/policy/session_options.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Options of all driven worlds. A policy uses the world's threads, lights and simulator too.
struct WorldOptions : SessionOptions {
  std::string map;
  int agents = 32;
  uint64_t seed = 0;
  bool walls = true;
  bool vector_observations = true;
  // Populations; without a value as in the policy's training, or as in the paper.
  std::optional<float> pedestrian_fraction, cyclist_fraction;
  std::optional<int> parked_cars;
  OtherShares others{};
  // Options of recorded scenes: the tracks that the policy drives, the start in the recording, and whether its lights
  // are used. An episode lasts for the rest of the recording, but at least min_episode_steps.
  std::string controlled = "self";
  int start_step = 0;
  bool recorded_lights = false;
  int min_episode_steps = 1;
};

/// Sets the given options in a simulator's configuration. A share of pedestrians or cyclists that is not given is
/// reduced to fit a given one. Throws UsageError if both are given and sum to more than 1.
void apply_world_options(const WorldOptions& options, SimulatorConfig* config_inout);

/// Whether a policy is the name of a controller that needs no checkpoint.
bool is_host_controller(const std::string& policy);

class PolicySession;

/// World with its driver.
struct DrivenWorld {
  std::unique_ptr<Simulator> simulator;
  // Parts of a trained policy: the session and, if it reads images, their renderer with its settings.
  std::shared_ptr<PolicySession> session;
  std::unique_ptr<Renderer> renderer;
  std::optional<RendererConfig> trained_view;
  std::unique_ptr<Controller> controller;
  std::vector<Command> commands;
  int first_agent = 0;  // default agent for films and replays: in recorded scenes the self-driving car

  /// Chooses the commands of the next step by the controller.
  void act() { controller->act(simulator->arrays(), {}, commands); }
  /// Steps by these commands, as step_observed() does.
  StepResult step(const std::vector<StepObserver*>& observers = {}) {
    return step_observed(*simulator, Span<Command>(commands), observers);
  }
};

/// Creates a world of options.agents agents on the map, at the start of its first episode, with evaluation's light
/// timing. `policy` drives: a controller of host_controller_names(), or a checkpoint's path (argmax; needs torch). In a
/// recorded scene it drives the controlled tracks that are present at the start; all others follow the recording, as do
/// all tracks with the policy "log".
/// With a checkpoint the world is that of the policy's training, with its walls, population, observations and
/// evaluation's conditioning, and its images are drawn as in training, unless the options differ. Throws UsageError for
/// a simulator that does not use host memory.
DrivenWorld make_world(const WorldOptions& options, const std::string& policy);

}  // namespace pictura
