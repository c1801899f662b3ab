// `pictura evaluate --protocol`: evaluations in recorded scenes, with their reports.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/evaluation/evaluate_scenes.h"

namespace pictura {

/// Arguments of evaluations in scenes, besides the options of every evaluation.
struct SceneArguments {
  std::string protocol;  // empty: no recorded scenes
  std::vector<std::string> scenes, rules;
  std::string control, csv, rollouts, realism;
  std::optional<int> start_step;
};

/// Adds --protocol, --scenes, --control, --start, --rule, --csv, --rollouts and --realism.
void add_scene_options(CLI::App* command, SceneArguments* arguments);

/// Throws UsageError for options that have no effect with, or without, --protocol.
void reject_idle_scene_options(const CLI::App& command, const SceneArguments& arguments);

/// Evaluates and prints a table, or one JSON object. densities: shares in %, or the protocol's if --density was not
/// given. `options` holds the driver and the range of scenes. out: a file for later merging, or empty. After an
/// interrupt it prints the completed results and throws Interrupted.
void run_scene_evaluation(const CLI::App& command, const SceneArguments& arguments, int steps,
                          const std::vector<std::string>& densities, SceneEvaluateOptions options,
                          const std::string& out, bool json);

/// Merges the parts of an evaluation in scenes, and prints and writes the result like a single evaluation.
void merge_scene_evaluations(const std::vector<std::string>& paths, const std::string& out, bool json);

}  // namespace pictura
