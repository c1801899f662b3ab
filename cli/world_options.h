// Options of commands that simulate a world.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "pictura/driving/world.h"

namespace pictura {

/// Adds --agents, --pedestrians, --cyclists, --parked, --seed, --threads and --no-walls, which fill *options_out.
void add_world_options(CLI::App* command, WorldOptions* options_out);

/// Adds --light-cycles. `otherwise` describes the default.
void add_light_cycles_option(CLI::App* command, std::optional<LightCycles>* cycles_out, const std::string& otherwise);

/// Adds --decision-steps.
CLI::Option* add_decision_steps_option(CLI::App* command, int* steps_out);

/// Adds --light-heads, for commands that draw images of worlds.
void add_light_heads_option(CLI::App* command, std::optional<LightHeads>* heads_out);

/// Adds the options of recorded scenes: --start and --recorded-lights.
void add_scene_options(CLI::App* command, WorldOptions* options_out);
/// Throws UsageError if --start, --recorded-lights or an option of `more` was given for a map that is not a recorded
/// scene.
void reject_scene_options(const CLI::App& command, const std::string& map, std::initializer_list<const char*> more);

/// Throws UsageError if one of these options was given. `why` explains why it would have no effect.
void reject_options(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

/// Adds MAP (a map or a recorded scene), all options above, --control, --steps, --policy, the shares of impaired agents
/// (--blind, --phantom-braking, --inattentive) and the policy's device options.
void add_driving_options(CLI::App* command, WorldOptions* world_out, int* steps_out, std::string* policy_out);

/// Adapts the options of add_driving_options() if MAP is a recorded scene. Without --policy, all road users follow the
/// recording (policy "log"). Without --steps, *steps_inout becomes 0, which means the length of the recording. Throws
/// UsageError for options that have no effect on this kind of MAP.
void resolve_driving_options(const CLI::App& command, WorldOptions* world_inout, int* steps_inout,
                             std::string* policy_inout);

/// Throws UsageError if options of devices or renderers were given for a controller, because a controller neither runs
/// a network nor draws images.
void reject_idle_backend_options(const CLI::App& command, const std::string& policy);

}  // namespace pictura
