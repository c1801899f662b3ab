// One simulated world on one map, with its driver: a controller, which has a name, or a policy from a checkpoint.
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

/// Options of a driven world. The base class contains the options that a policy's session also uses, such as threads
/// and lights.
struct WorldOptions : SessionOptions {
  std::string map;
  int agents = 32;
  uint64_t seed = 0;
  bool walls = true;
  bool vector_observations = true;
  // Shares of pedestrians and cyclists. Without values, they are those of the policy's training, or the default shares
  // for a controller.
  std::optional<float> pedestrian_fraction, cyclist_fraction;
  std::optional<int> parked_cars;
  OtherShares others{};
  // Options for recorded scenes: the tracks that the policy drives, the step of the recording at which episodes begin,
  // and whether the recorded traffic lights are used. An episode lasts for the rest of the recording, but at least
  // min_episode_steps steps.
  std::string controlled = "self";
  int start_step = 0;
  bool recorded_lights = false;
  int min_episode_steps = 1;
};

/// Applies the options to a simulator's configuration; options without a value keep the configuration's value. If only
/// one of the shares of pedestrians and cyclists is given, reduces the other share so that their sum is at most 1.
/// Throws UsageError if both are given and their sum exceeds 1.
void apply_world_options(const WorldOptions& options, SimulatorConfig* config_inout);

/// Whether `policy` is the name of a controller, which needs no checkpoint.
bool is_host_controller(const std::string& policy);

class PolicySession;

/// A world with its driver.
struct DrivenWorld {
  std::unique_ptr<Simulator> simulator;
  // Only for a policy: its session and, if it reads images, the renderer of these images and the renderer's
  // configuration.
  std::shared_ptr<PolicySession> session;
  std::unique_ptr<Renderer> renderer;
  std::optional<RendererConfig> trained_view;
  std::unique_ptr<Controller> controller;
  std::vector<Command> commands;
  // Default agent for films and replays. In recorded scenes it is the self-driving car.
  int first_agent = 0;

  /// Lets the controller choose the commands of the next step.
  void act() { controller->act(simulator->arrays(), {}, commands); }
  /// Simulates one step with the chosen commands, as step_observed() does.
  StepResult step(const std::vector<StepObserver*>& observers = {}) {
    return step_observed(*simulator, Span<Command>(commands), observers);
  }
};

/// Creates a world of options.agents agents on the map, at the start of its first episode, with the light timing of
/// evaluations. `policy` is the driver: a controller of host_controller_names(), or the path of a checkpoint. A
/// checkpoint's policy takes its most likely actions. In a recorded scene, the driver drives the controlled tracks that
/// are present at the start, and all other tracks follow the recording. With the controller "log", all tracks follow
/// the recording. If `policy` is a checkpoint, then walls, population, observations and images are those of its
/// training unless the options override them, and the conditioning is that of evaluations. Throws UsageError for a
/// simulator that does not use host memory.
DrivenWorld make_world(const WorldOptions& options, const std::string& policy);

}  // namespace pictura
