// Evaluations of `pictura evaluate --protocol` in recorded scenes, and their reports.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/evaluation/evaluate_scenes.h"

namespace pictura {

/// Arguments of evaluations in recorded scenes, in addition to the options of all evaluations.
struct SceneArguments {
  std::string protocol;  // name of the protocol; empty: no recorded scenes
  std::vector<std::string> scenes, rules;
  std::string control, csv, rollouts, realism;
  std::optional<int> start_step;
};

/// Adds --protocol, --scenes, --control, --start, --rule, --csv, --rollouts and --realism.
void add_scene_options(CLI::App* command, SceneArguments* arguments);

/// Throws UsageError for options that have no effect: options for towns if --protocol was given, and options for scenes
/// if it was not.
void reject_idle_scene_options(const CLI::App& command, const SceneArguments& arguments);

/// Evaluates in recorded scenes, and prints a table, or one JSON object if `json`. `densities` are shares of remaining
/// road users in %; without --density, they are those of the protocol. `options` contains the driver and the range of
/// scenes. `out` is a file for later merging, or empty. After an interrupt, prints the completed results and throws
/// Interrupted.
void run_scene_evaluation(const CLI::App& command, const SceneArguments& arguments, int steps,
                          const std::vector<std::string>& densities, SceneEvaluateOptions options,
                          const std::string& out, bool json);

/// Merges the parts of an evaluation in recorded scenes. Prints and writes the result as for a single evaluation.
void merge_scene_evaluations(const std::vector<std::string>& paths, const std::string& out, bool json);

}  // namespace pictura
