// Small evaluation within a run: the protocol of evaluation/ in a few worlds on the training maps. It draws with the
// run's own renderer, or with a separate renderer if the run's renderer randomizes cameras. It shares no state with
// training, which continues as if there had been no evaluation.
#pragma once

#include <optional>

#include "pictura/evaluation/evaluate.h"
#include "pictura/training/run.h"
#include "pictura/training/run_log.h"

namespace pictura {

class RunEvaluation {
 public:
  /// Creates the evaluation of a run, which must outlive it.
  explicit RunEvaluation(const Run& run);

  /// Whether an evaluation is due after the run's completed updates.
  bool is_due() const;
  /// Evaluates in train.evaluate_scenarios worlds of train.evaluate_agents agents for train.evaluate_steps steps. The
  /// result equals that of `pictura evaluate` on the checkpoint, with these numbers as --scenarios, --agents and
  /// --steps. If the run averages weights, average_row equals the result with --average. The result is empty after an
  /// interrupt.
  std::optional<EvaluationRecord> evaluate();

 private:
  const Run& run_;
  EvaluationWorlds worlds_;  // reused by later evaluations
};

}  // namespace pictura
