// `pictura evaluate --protocol` in recorded scenes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/evaluation/evaluate_scenes.h"

namespace pictura {

/// Arguments in addition to the options of all evaluations.
struct SceneArguments {
  std::string protocol;  // empty: no recorded scenes
  std::vector<std::string> scenes, rules;
  std::string control, csv, rollouts, realism;
  std::optional<int> start_step;
};

/// Adds --protocol, --scenes, --control, --start, --rule, --csv, --rollouts and --realism.
void add_scene_options(CLI::App* command, SceneArguments* arguments);

/// Throws UsageError for options of towns with --protocol, and options of scenes without it.
void reject_idle_scene_options(const CLI::App& command, const SceneArguments& arguments);

/// Prints a table, or one JSON object if `json`. `densities`: shares of road users to keep, in %. Without --density,
/// the protocol's shares apply instead. `out`: file for later merging, or empty. After an interrupt, prints the
/// completed results and throws Interrupted.
void run_scene_evaluation(const CLI::App& command, const SceneArguments& arguments, int steps,
                          const std::vector<std::string>& densities, SceneEvaluateOptions options,
                          const std::string& out, bool json);

/// Merges parts, and prints and writes the result.
void merge_scene_evaluations(const std::vector<std::string>& paths, const std::string& out, bool json);

}  // namespace pictura
