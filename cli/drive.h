// One world of one map for `render` and `simulate`, and the controller that drives in it, by name or from a checkpoint.
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/cli/backend_options.h"
#include "pictura/common/renderer.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Options that every command with a world shares.
struct WorldOptions {
  std::string map;
  int agents = 32;
  uint64_t seed = 0;
  int num_threads = 0;
  bool walls = true;
  bool vector_observations = true;
  // Where nothing is said, as the policy was trained, or as in the paper.
  std::optional<float> pedestrian_fraction, cyclist_fraction;
  std::optional<int> parked_cars;
  std::optional<LightCycles> light_cycles;
  std::optional<LightHeads> light_heads;
  // Of recorded scenes: which tracks the policy drives, where the recording starts, and whether its lights are there.
  // An episode is as long as what is left of the recording, or as so many steps.
  std::string controlled = "self";
  int start_step = 0;
  bool recorded_lights = false;
  int min_episode_steps = 1;
};

/// Adds --agents, --pedestrians, --cyclists, --parked, --seed, --threads and --no-walls, which fill *options_out.
void add_world_options(CLI::App* command, WorldOptions* options_out);

/// Adds --light-cycles. `otherwise` says what holds where it is not given.
void add_light_cycles_option(CLI::App* command, std::optional<LightCycles>* cycles_out, const std::string& otherwise);

/// Adds --light-heads, for commands whose worlds are seen by cameras.
void add_light_heads_option(CLI::App* command, std::optional<LightHeads>* heads_out);

/// Adds what chooses of a recorded scene: --start and --recorded-lights.
void add_scene_options(CLI::App* command, WorldOptions* options_out);
/// Throws UsageError where one of these, or of `more` options of recorded scenes, was given for another map.
void refuse_scene_options(const CLI::App& command, const std::string& map, std::initializer_list<const char*> more);

/// Throws UsageError where one of these options was given; `why` says where it would have no effect.
void refuse_options(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

/// Adds MAP, which may be a recorded scene, those options, --light-cycles, --light-heads, --control, --start, --steps,
/// --policy and where the policy runs.
void add_driving_options(CLI::App* command, WorldOptions* world_out, int* steps_out, std::string* policy_out,
                         BackendOptions* backends_out);

/// What these options mean for a recorded scene, where MAP is one: everybody is driven as recorded unless a policy was
/// asked for, for as many steps as are recorded unless --steps was given (else *steps_inout becomes 0). Throws
/// UsageError for options that have no effect on what MAP is.
void settle_driving_options(const CLI::App& command, WorldOptions* world_inout, int* steps_inout,
                            std::string* policy_inout);

/// Sets the shares of pedestrians and cyclists that were given; a share that was not gives way to one that was. Throws
/// UsageError where both were given and are more than 1.
void set_population(const WorldOptions& options, SimulatorConfig* config_inout);

/// Whether a policy is the name of a controller that needs no checkpoint.
bool is_host_controller(const std::string& policy);

/// Throws UsageError where a policy that computes and draws nothing was given options that say by what.
void refuse_idle_backend_options(const CLI::App& command, const std::string& policy);

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
  void act() { controller->act(simulator->controller_input(), {}, commands); }
  StepResult step() { return simulator->step(commands); }
};

/// A world of options.agents agents on the map, at the start of its first episode, with evaluation's light timing.
/// `policy` drives: a controller of host_controller_names(), or a checkpoint's path (argmax; needs torch). In a
/// recorded scene it drives the controlled tracks that are there at the start; all others, or with the policy log all,
/// follow the recording.
/// Then the world is the one that the policy was trained in, with its walls, population, observations and evaluation's
/// conditioning, and its images are drawn as they were in training; `backends` and options say otherwise. Throws
/// UsageError for a simulator that does not work in host memory.
DrivenWorld make_world(const WorldOptions& options, const std::string& policy, const BackendOptions& backends);

}  // namespace pictura
