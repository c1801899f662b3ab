// Options of commands that simulate evaluation worlds.
#pragma once

#include <chrono>
#include <string>

#include "pictura/cli/backend_options.h"
#include "pictura/cli/interval_text.h"
#include "pictura/cli/report.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// Adds the options of worlds and devices. The default maps are the paper's eight towns. Returns --sampled.
CLI::Option* add_evaluation_options(CLI::App* command, EvaluateOptions* options_out);

CLI::Option* add_sampled_option(CLI::App* command, bool* argmax_out);

/// Adds --average, for a checkpoint's averaged weights.
CLI::Option* add_average_option(CLI::App* command, bool* average_out);

/// Progress of an evaluation. For a long evaluation, also prints the expected time and ways to shorten it.
class EvaluationProgress {
 public:
  /// `finished`: results that an interrupt leaves, such as "the completed scenarios". `shorter`: option of a shorter
  /// evaluation, with its effect.
  EvaluationProgress(std::string finished, std::string shorter)
      : finished_(std::move(finished)), shorter_(std::move(shorter)) {}
  void update(double done, double eta_s);
  void finish() { line_.finish(); }

 private:
  std::string finished_, shorter_;
  ProgressLine line_;
  const Stopwatch since_start_;
  bool has_estimate_ = false;
};

/// Returns the report's first keys: driver and devices.
Json driver_json(const DriverOptions& options, const EvaluationSetting& setting);

}  // namespace pictura
