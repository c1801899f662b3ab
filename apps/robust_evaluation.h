// `pictura evaluate --protocol robust`: its table and its JSON.
#pragma once

#include <CLI/CLI.hpp>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// Evaluates the driver of `options` in all conditions, and prints a table, or one JSON object. Throws UsageError for
/// options of the command that the protocol fixes. After ^C, prints the finished conditions and throws Interrupted.
void run_robust_evaluation(const CLI::App& command, const EvaluateOptions& options, bool json);

}  // namespace pictura
