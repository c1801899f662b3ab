#include "pictura/cli/world_options.h"

#include <iterator>

#include "pictura/cli/backend_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/common/error.h"
#include "pictura/configuration/policy_section.h"
#include "pictura/map/scenario/load_scenario.h"

namespace pictura {

void add_world_options(CLI::App* command, WorldOptions* options_out) {
  add_number_option(command, "--agents", options_out->agents,
                    "Number of agents (vehicles, cyclists and pedestrians) in the world", 1, kMaxAgentsPerWorld);
  // The default is the value that the command presets if there is one, else the value of the policy's training, else
  // the simulator's default.
  const SimulatorConfig simulator;
  auto with_default = [](const char* what, auto preset, auto simulators) {
    return fmt::format("{}; default: {}{}", what, preset.value_or(simulators),
                       preset ? "" : ", or, with a trained policy, as in training");
  };
  add_number_option(command, "--pedestrians", options_out->pedestrian_fraction,
                    with_default("Share of pedestrians among the agents", options_out->pedestrian_fraction,
                                 simulator.pedestrian_fraction),
                    0, 1);
  add_number_option(
      command, "--cyclists", options_out->cyclist_fraction,
      with_default("Share of cyclists among the agents", options_out->cyclist_fraction, simulator.cyclist_fraction), 0,
      1);
  add_number_option(command, "--parked", options_out->parked_cars,
                    with_default("Number of parked cars", options_out->parked_cars, simulator.parked_cars), 0,
                    kMaxAgentsPerWorld);
  add_seed_option(command, &options_out->seed, "Seed of the agents' positions, sizes, goals and random actions");
  add_threads_option(command, &options_out->num_threads);
  command->add_flag("!--no-walls", options_out->walls, "Leave out the walls along the building lines");
}

void add_light_cycles_option(CLI::App* command, std::optional<LightCycles>* cycles_out, const std::string& otherwise) {
  command
      ->add_option_function<std::string>(
          "--light-cycles", [cycles_out](const std::string& name) { *cycles_out = light_cycles_named(name); },
          fmt::format("Cycles of traffic lights: phases (the lights of a junction take turns) or independent (each "
                      "light has its own cycle); default: {}",
                      otherwise))
      ->check(one_of({std::begin(kLightCyclesNames), std::end(kLightCyclesNames)}));
}

CLI::Option* add_decision_steps_option(CLI::App* command, int* steps_out) {
  return add_number_option(command, "--decision-steps", *steps_out,
                           "Steps for which a trained policy holds each action; 0: as in training", 0,
                           kMaxDecisionSteps);
}

void add_light_heads_option(CLI::App* command, std::optional<LightHeads>* heads_out) {
  command
      ->add_option_function<std::string>(
          "--light-heads", [heads_out](const std::string& name) { *heads_out = light_heads_named(name); },
          fmt::format("Position of light heads: as_mapped (as in the map), or visible (heads beside or before their "
                      "stop line are moved {} m beyond it); default: {}, or, with a trained policy, as in training",
                      kVisibleHeadAhead_m, name_of(SimulatorConfig{}.light_heads)))
      ->check(one_of({kLightHeadsNames.begin(), kLightHeadsNames.end()}));
}

void add_scene_options(CLI::App* command, WorldOptions* options_out) {
  add_number_option(command, "--start", options_out->start_step, "Step of a recorded scene at which episodes begin", 0,
                    kMaxScenarioSteps - 1);
  command->add_flag("--recorded-lights", options_out->recorded_lights,
                    "Use the lights of a recorded scene: they are drawn, observed and enforced");
}

void reject_scene_options(const CLI::App& command, const std::string& map, std::initializer_list<const char*> more) {
  const std::string why = fmt::format("on {}, which is no recorded scene", map);
  reject_options(command, {"--start", "--recorded-lights"}, why);
  reject_options(command, more, why);
}

void reject_options(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why) {
  for (const char* option : options) {
    if (command.count(option) > 0) fail_usage("{}: has no effect {}", option, why);
  }
}

void reject_other_options(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why) {
  for (const CLI::Option* const given : command.parse_order()) {
    const std::string name = given->get_name();
    const bool is_allowed = std::find(options.begin(), options.end(), name) != options.end();
    if (!is_allowed && !given->get_positional()) fail_usage("{}: has no effect {}", name, why);
  }
}

void add_driving_options(CLI::App* command, WorldOptions* world_out, int* steps_out, std::string* policy_out) {
  add_map_or_scene(command, &world_out->map);
  add_world_options(command, world_out);
  add_light_cycles_option(
      command, &world_out->light_cycles,
      fmt::format("{}, or, with a trained policy, as in training", name_of(SimulatorConfig{}.light_cycles)));
  add_light_heads_option(command, &world_out->light_heads);
  command
      ->add_option("--control", world_out->controlled,
                   "Tracks of a recorded scene that --policy drives, separated by commas: self (the self-driving car), "
                   "vehicles (all other vehicles), others (non-vehicles), all, tracks_to_predict, objects_of_interest, "
                   "and ids; tracks that are absent at the start follow the recording")
      ->capture_default_str();
  add_scene_options(command, world_out);
  add_number_option(command, "--steps", *steps_out, "Steps of 0.1 s; default for a recorded scene: its length", 1);
  command
      ->add_option("--policy", *policy_out,
                   "Driver of the agents: random, idle, lane (follows lanes), idm_lanes (follows lanes and vehicles "
                   "ahead), or a checkpoint or safetensors file written by train; in recorded scenes also log (repeats "
                   "the recording, the default there), inverse (takes the actions that follow the recording most "
                   "closely), idm (follows recorded paths and vehicles ahead)")
      ->check(input_file())
      ->capture_default_str();
  OtherShares& others = world_out->others;
  add_number_option(command, "--blind", others.blind,
                    "Share of the agents that see no other road users for some seconds", 0, 1);
  add_number_option(command, "--phantom-braking", others.phantom_braking,
                    "Share of the agents that brake hard for some seconds", 0, 1);
  add_number_option(command, "--inattentive", others.inattentive, "Share of the agents that see no traffic lights", 0,
                    1);
  add_decision_steps_option(command, &world_out->decision_steps);
  add_policy_backend_options(command, "auto (renderer: as in training)", world_out);
}

void resolve_driving_options(const CLI::App& command, WorldOptions* world_inout, int* steps_inout,
                             std::string* policy_inout) {
  if (!is_scene_name(world_inout->map)) {
    return reject_scene_options(command, world_inout->map, {"--control"});
  }
  reject_options(command,
                 {"--agents", "--pedestrians", "--cyclists", "--parked", "--no-walls", "--light-cycles",
                  "--light-heads", "--blind", "--phantom-braking", "--inattentive"},
                 "on a recorded scene, which defines it");
  if (command.count("--policy") == 0) *policy_inout = "log";
  if (*policy_inout == "log") {
    reject_options(command, {"--control"}, "with the policy log, which drives all agents as recorded");
  }
  if (command.count("--steps") == 0) {
    *steps_inout = 0;
  } else {
    world_inout->min_episode_steps = *steps_inout;
  }
}

void reject_idle_backend_options(const CLI::App& command, const std::string& policy) {
  if (!is_host_controller(policy)) return;
  reject_options(command, {"--device", "--renderer", "--samples"},
                 fmt::format("with the policy '{}', which computes and draws nothing", policy));
}

}  // namespace pictura
