// Small evaluation on a run's training maps, which changes no state of training.
#pragma once

#include <optional>

#include "pictura/evaluation/evaluate.h"
#include "pictura/training/run.h"
#include "pictura/training/run_log.h"

namespace pictura {

class RunEvaluation {
 public:
  /// The run must outlive the evaluation.
  explicit RunEvaluation(const Run& run);

  /// Whether an evaluation is due after the completed updates.
  bool is_due() const;
  /// Evaluates as train.evaluate_* specify; empty after an interrupt. The result equals that of `pictura evaluate` on
  /// the checkpoint with equal --scenarios, --agents and --steps; average_row equals that with --average.
  std::optional<EvaluationRecord> evaluate();

 private:
  const Run& run_;
  EvaluationWorlds worlds_;  // reused by later evaluations
};

}  // namespace pictura
