// Options of commands that simulate a world.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "pictura/driving/world.h"

namespace pictura {

void add_world_options(CLI::App* command, WorldOptions* options_out);

/// Adds --light-cycles; `otherwise` describes the default.
void add_light_cycles_option(CLI::App* command, std::optional<LightCycles>* cycles_out, const std::string& otherwise);

CLI::Option* add_decision_steps_option(CLI::App* command, int* steps_out);

void add_light_heads_option(CLI::App* command, std::optional<LightHeads>* heads_out);

/// Adds --start and --recorded-lights.
void add_scene_options(CLI::App* command, WorldOptions* options_out);
/// Throws UsageError if one of these options, or of `more`, was given for a map that is not a recorded scene.
void reject_scene_options(const CLI::App& command, const std::string& map, std::initializer_list<const char*> more);

/// Throws UsageError if one of these options was given. `why`: why the options have no effect.
void reject_options(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);
/// Throws UsageError for the first given option that is not among `options`. Positional arguments are not options.
void reject_other_options(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

/// Adds MAP, all options above, --control, --steps, --policy, the shares of impaired agents, and the policy's device
/// options.
void add_driving_options(CLI::App* command, WorldOptions* world_out, int* steps_out, std::string* policy_out);

/// Adapts the options of add_driving_options() to a recorded scene. Without --policy, all road users follow the
/// recording (policy "log"). Without --steps, *steps_inout becomes 0: the length of the recording. Throws UsageError
/// for options without effect on this kind of MAP.
void resolve_driving_options(const CLI::App& command, WorldOptions* world_inout, int* steps_inout,
                             std::string* policy_inout);

/// Throws UsageError for device or renderer options of a controller, which has no network and no images.
void reject_idle_backend_options(const CLI::App& command, const std::string& policy);

}  // namespace pictura
