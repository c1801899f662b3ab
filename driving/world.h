// One world of one map, and the controller that drives in it, by name or from a checkpoint.
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

/// What all worlds that are driven here share. Threads, lights and simulator of a policy are the world's as well.
struct WorldOptions : SessionOptions {
  std::string map;
  int agents = 32;
  uint64_t seed = 0;
  bool walls = true;
  bool vector_observations = true;
  // Where nothing is said, as the policy was trained, or as in the paper.
  std::optional<float> pedestrian_fraction, cyclist_fraction;
  std::optional<int> parked_cars;
  OtherShares others{};
  // Of recorded scenes: which tracks the policy drives, where the recording starts, and whether its lights are there.
  // An episode is as long as what is left of the recording, or as so many steps.
  std::string controlled = "self";
  int start_step = 0;
  bool recorded_lights = false;
  int min_episode_steps = 1;
};

/// Sets what was given of a simulator's options; a share of pedestrians or cyclists that was not gives way to one that
/// was. Throws UsageError where both were given and are more than 1.
void apply_world_options(const WorldOptions& options, SimulatorConfig* config_inout);

/// Whether a policy is the name of a controller that needs no checkpoint.
bool is_host_controller(const std::string& policy);

class PolicySession;

/// One world and who drives in it.
struct DrivenWorld {
  std::unique_ptr<Simulator> simulator;
  // Of a trained policy: itself and, where it reads images, what draws them and with which settings.
  std::shared_ptr<PolicySession> session;
  std::unique_ptr<Renderer> renderer;
  std::optional<RendererConfig> trained_view;
  std::unique_ptr<Controller> controller;
  std::vector<Command> commands;
  int first_agent = 0;  // that films and replays follow unless they are told: in recorded scenes the self-driving car

  /// Lets the controller choose the commands of the next step.
  void act() { controller->act(simulator->arrays(), {}, commands); }
  /// Steps by them, as step_observed().
  StepResult step(const std::vector<StepObserver*>& observers = {}) {
    return step_observed(*simulator, Span<Command>(commands), observers);
  }
};

/// A world of options.agents agents on the map, at the start of its first episode, with evaluation's light timing.
/// `policy` drives: a controller of host_controller_names(), or a checkpoint's path (argmax; needs torch). In a
/// recorded scene it drives the controlled tracks that are there at the start; all others, or with the policy log all,
/// follow the recording.
/// Then the world is the one that the policy was trained in, with its walls, population, observations and evaluation's
/// conditioning, and its images are drawn as they were in training; the options say otherwise. Throws UsageError for a
/// simulator that does not work in host memory.
DrivenWorld make_world(const WorldOptions& options, const std::string& policy);

}  // namespace pictura
