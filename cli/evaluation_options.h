// Options of commands that simulate evaluation worlds: options of the worlds and devices.
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

/// Adds --map, --agents, --steps, --sampled, --seed, --device, --simulator, --renderer, --samples, --conditioning,
/// --light-cycles, --light-heads and --threads. The default maps are the paper's eight towns. Returns --sampled.
CLI::Option* add_evaluation_options(CLI::App* command, EvaluateOptions* options_out);

/// Adds --sampled, which sets *argmax_out to false.
CLI::Option* add_sampled_option(CLI::App* command, bool* argmax_out);

/// Adds --average, which selects a checkpoint's averaged weights.
CLI::Option* add_average_option(CLI::App* command, bool* average_out);

/// Reports the progress of an evaluation. For a long evaluation, also prints one notice of the expected time and of
/// ways to shorten the evaluation.
class EvaluationProgress {
 public:
  /// `finished` names the results that are reported after an interrupt, such as "the completed scenarios".
  explicit EvaluationProgress(std::string finished) : finished_(std::move(finished)) {}
  void update(double done, double eta_s);
  void finish() { line_.finish(); }

 private:
  std::string finished_;
  ProgressLine line_;
  const Stopwatch since_start_;
  bool has_estimate_ = false;
};

/// Returns the first keys of evaluation reports, which describe the driver and its devices.
Json driver_json(const DriverOptions& options, const EvaluationSetting& setting);

}  // namespace pictura
