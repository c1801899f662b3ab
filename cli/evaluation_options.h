// Options of commands that drive evaluation worlds: which worlds, and what computes.
#pragma once

#include "pictura/cli/backend_options.h"
#include "pictura/training/evaluation/evaluate.h"

namespace pictura {

/// Made with the paper's eight towns.
struct EvaluationArguments {
  EvaluationArguments();
  EvaluateOptions evaluate;
  BackendOptions backends;
  bool sampled = false;
};

/// Adds --map, --agents, --steps, --sampled, --seed, --device, --simulator, --renderer, --samples, --conditioning and
/// --threads. Returns --sampled.
CLI::Option* add_evaluation_options(CLI::App* command, EvaluationArguments* arguments);

/// Puts into arguments->evaluate what has been parsed beside it.
void settle_evaluation_options(EvaluationArguments* arguments);

}  // namespace pictura
