// Runs `pictura evaluate --protocol robust`.
#pragma once

#include <CLI/CLI.hpp>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// Prints a table, or one JSON object if `json`. Throws UsageError for command options that the protocol fixes. After
/// an interrupt, prints the completed conditions and throws Interrupted.
void run_robust_evaluation(const CLI::App& command, const EvaluateOptions& options, bool json);

}  // namespace pictura
