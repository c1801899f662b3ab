// Options of commands that drive evaluation worlds: which worlds, and what computes.
#pragma once

#include <chrono>
#include <string>

#include "pictura/cli/backend_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// Adds --map, --agents, --steps, --sampled, --seed, --device, --simulator, --renderer, --samples, --conditioning,
/// --light-cycles, --light-heads and --threads. The maps are the paper's eight towns unless others are given. Returns
/// --sampled.
CLI::Option* add_evaluation_options(CLI::App* command, EvaluateOptions* options_out);

/// Adds --sampled, which makes *argmax_out false.
CLI::Option* add_sampled_option(CLI::App* command, bool* argmax_out);

/// Adds --average, which chooses the average of weights that a checkpoint holds.
CLI::Option* add_average_option(CLI::App* command, bool* average_out);

/// "0.123 +- 0.045": the estimate and the half width of its interval; "-" for what there is not.
std::string interval_text(const Estimate& estimate, int decimals = 3);

/// Says how far an evaluation is, and once, where it takes long, for how long and what can be done about it.
class EvaluationProgress {
 public:
  /// `finished` is what ^C reports: "the scenarios that are finished".
  explicit EvaluationProgress(std::string finished) : finished_(std::move(finished)) {}
  void update(double done, double eta_s);
  void finish() { line_.finish(); }

 private:
  std::string finished_;
  ProgressLine line_;
  const Stopwatch since_start_;
  bool has_estimate_ = false;
};

/// What reports of evaluations begin with: who drove, and where it computed.
Json driver_json(const DriverOptions& options, const EvaluationSetting& setting);

}  // namespace pictura
