// One world of one map with its driver: a controller by name, or a policy from a checkpoint.
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
  // Shares of pedestrians and cyclists. Without values, the shares of the policy's training, or the paper's for a
  // controller.
  std::optional<float> pedestrian_fraction, cyclist_fraction;
  std::optional<int> parked_cars;
  OtherShares others{};
  // Options of recorded scenes: the tracks that the policy drives, the step of the recording at which episodes begin,
  // and whether the recorded lights are used. An episode lasts for the rest of the recording, but at least
  // min_episode_steps.
  std::string controlled = "self";
  int start_step = 0;
  bool recorded_lights = false;
  int min_episode_steps = 1;
};

/// Sets those options in a simulator's configuration that have a value. If only one of the shares of pedestrians and
/// cyclists is given, the other share is reduced so that both sum to at most 1. Throws UsageError if both are given and
/// sum to more than 1.
void apply_world_options(const WorldOptions& options, SimulatorConfig* config_inout);

/// Whether `policy` is the name of a controller, which needs no checkpoint.
bool is_host_controller(const std::string& policy);

class PolicySession;

/// World with its driver.
struct DrivenWorld {
  std::unique_ptr<Simulator> simulator;
  // Parts of a trained policy: its session and, if it reads images, the renderer of these images with its settings.
  std::shared_ptr<PolicySession> session;
  std::unique_ptr<Renderer> renderer;
  std::optional<RendererConfig> trained_view;
  std::unique_ptr<Controller> controller;
  std::vector<Command> commands;
  int first_agent = 0;  // default agent for films and replays: in recorded scenes the self-driving car

  /// Chooses the commands of the next step by the controller.
  void act() { controller->act(simulator->arrays(), {}, commands); }
  /// Steps the world by the chosen commands, as step_observed() does.
  StepResult step(const std::vector<StepObserver*>& observers = {}) {
    return step_observed(*simulator, Span<Command>(commands), observers);
  }
};

/// Creates a world of options.agents agents on the map, at the start of its first episode, with the light timing of
/// evaluations. `policy` is the driver: a controller of host_controller_names(), or a checkpoint's path, whose most
/// likely actions are used. In a recorded scene it drives the controlled tracks that are present at the start; all
/// other tracks follow the recording. With the policy "log" all tracks follow the recording.
/// With a checkpoint, walls, population and observations are those of the policy's training, and images are drawn as in
/// training, unless the options differ. The conditioning is that of evaluations. Throws UsageError for a simulator that
/// does not use host memory.
DrivenWorld make_world(const WorldOptions& options, const std::string& policy);

}  // namespace pictura
