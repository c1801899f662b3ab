// One simulated world with its driver: a named controller or a checkpoint's policy.
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

struct WorldOptions : SessionOptions {
  std::string map;
  int agents = 32;
  uint64_t seed = 0;
  bool walls = true;
  bool vector_observations = true;
  // Empty: the shares of the policy's training, or the defaults for a controller.
  std::optional<float> pedestrian_fraction, cyclist_fraction;
  std::optional<int> parked_cars;
  OtherShares others{};
  // For recorded scenes: driven tracks, first step, and whether recorded lights are used. An episode lasts for the rest
  // of the recording, but at least min_episode_steps.
  std::string controlled = "self";
  int start_step = 0;
  bool recorded_lights = false;
  int min_episode_steps = 1;
};

/// Applies the options that have values. If only one of the shares of pedestrians and cyclists is given, reduces the
/// other so that their sum is at most 1. Throws UsageError if both are given and their sum exceeds 1.
void apply_world_options(const WorldOptions& options, SimulatorConfig* config_inout);

/// Whether `policy` names a controller.
bool is_host_controller(const std::string& policy);

class PolicySession;

struct DrivenWorld {
  std::unique_ptr<Simulator> simulator;
  // For a policy: its session. `renderer` and `trained_view` are set only if the policy reads images.
  std::shared_ptr<PolicySession> session;
  std::unique_ptr<Renderer> renderer;
  std::optional<RendererConfig> trained_view;
  std::unique_ptr<Controller> controller;
  std::vector<Command> commands;
  // Default agent of films and replays; in recorded scenes, the self-driving car.
  int first_agent = 0;

  /// Chooses the commands of the next step.
  void act() { controller->act(simulator->arrays(), {}, commands); }
  /// Simulates one step as step_observed() does.
  StepResult step(const std::vector<StepObserver*>& observers = {}) {
    return step_observed(*simulator, Span<Command>(commands), observers);
  }
};

/// Creates a world at the start of its first episode, with the light timing of evaluations. `policy`: a controller of
/// host_controller_names(), or the path of a checkpoint, whose policy takes its most likely actions. A checkpoint's
/// training determines walls, population, observations and images, unless the options override them; the conditioning
/// is that of evaluations. In a recorded scene, the driver drives the controlled tracks; with the controller "log", all
/// tracks follow the recording. Throws UsageError for a simulator without host memory.
DrivenWorld make_world(const WorldOptions& options, const std::string& policy);

}  // namespace pictura
