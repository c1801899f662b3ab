// Options of commands that drive a world.
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

/// Adds --light-heads, for commands whose worlds cameras see.
void add_light_heads_option(CLI::App* command, std::optional<LightHeads>* heads_out);

/// Adds the options of recorded scenes: --start and --recorded-lights.
void add_scene_options(CLI::App* command, WorldOptions* options_out);
/// Throws UsageError if one of these options, or of `more` options of recorded scenes, was given for another map.
void reject_scene_options(const CLI::App& command, const std::string& map, std::initializer_list<const char*> more);

/// Throws UsageError if one of these options was given; `why` explains why it would have no effect.
void reject_options(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

/// Adds MAP (a map or a recorded scene), the options above, --light-cycles, --light-heads, --control, --start, --steps,
/// --policy and the policy's device options.
void add_driving_options(CLI::App* command, WorldOptions* world_out, int* steps_out, std::string* policy_out);

/// Adapts these options to a recorded scene, if MAP is one: all road users follow the recording unless a policy was
/// requested, for as many steps as are recorded unless --steps was given (else *steps_inout becomes 0). Throws
/// UsageError for options that have no effect on this kind of MAP.
void resolve_driving_options(const CLI::App& command, WorldOptions* world_inout, int* steps_inout,
                             std::string* policy_inout);

/// Throws UsageError if backend options were given for a policy that neither computes nor draws.
void reject_idle_backend_options(const CLI::App& command, const std::string& policy);

}  // namespace pictura
