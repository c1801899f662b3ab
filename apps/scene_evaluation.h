// `pictura evaluate --protocol`: evaluations in recorded scenes, and their reports.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pictura/evaluation/evaluate_scenes.h"

namespace pictura {

/// What the command is told besides the options of every evaluation.
struct SceneArguments {
  std::string protocol;  // empty: no recorded scenes
  std::vector<std::string> scenes, rules;
  std::string control, csv, rollouts;
  std::optional<int> start_step;
};

/// Adds --protocol, --scenes, --control, --start, --rule, --csv and --rollouts.
void add_scene_options(CLI::App* command, SceneArguments* arguments);

/// Throws UsageError for options that have no effect with, or without, --protocol.
void refuse_idle_scene_options(const CLI::App& command, const SceneArguments& arguments);

/// Evaluates and prints a table, or one JSON object. densities: shares in %, or as the protocol has them where
/// --density was not given; options holds who drives, and which scenes of all; out: a file for what merging reads, or
/// empty. Throws Interrupted, after what is finished was printed, where ^C came.
void run_scene_evaluation(const CLI::App& command, const SceneArguments& arguments, int steps,
                          const std::vector<std::string>& densities, SceneEvaluateOptions options,
                          const std::string& out, bool json);

/// Joins the parts of an evaluation in scenes, and prints and writes what one evaluation would have.
void merge_scene_evaluations(const std::vector<std::string>& paths, const std::string& out, bool json);

}  // namespace pictura
