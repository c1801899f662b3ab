// Subcommands of `pictura`, one file each. Each function registers its command with CLI11. The command throws Error,
// UsageError or Interrupted, which run_command() converts.
#pragma once

#include <CLI/CLI.hpp>

namespace pictura {

void add_town_command(CLI::App& app);
void add_map_command(CLI::App& app);
void add_plot_command(CLI::App& app);
void add_completion_command(CLI::App& app);
void add_render_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_simulate_command(CLI::App& app);
void add_score_command(CLI::App& app);
#ifdef PICTURA_HAS_TORCH
void add_train_command(CLI::App& app);
#endif
void add_evaluate_command(CLI::App& app);
void add_probe_command(CLI::App& app);
void add_export_command(CLI::App& app);

}  // namespace pictura
