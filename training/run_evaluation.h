// The small evaluation that a run makes of itself: the protocol of evaluation/ in a few worlds on the maps of training,
// with the run's own renderer, or, where that randomizes cameras, with one that does not. It shares no state with
// training, which goes on as if there had been none.
#pragma once

#include <optional>

#include "pictura/evaluation/evaluate.h"
#include "pictura/training/run.h"
#include "pictura/training/run_log.h"

namespace pictura {

class RunEvaluation {
 public:
  /// Evaluation of a run, which must outlive it.
  explicit RunEvaluation(const Run& run);

  /// Whether an evaluation is due after as many updates as the run has done.
  bool is_due() const;
  /// Evaluates in train.evaluate_scenarios worlds of train.evaluate_agents agents for train.evaluate_steps steps: what
  /// `pictura evaluate --scenarios --agents --steps` measures of the checkpoint, and with --average where the run has
  /// an average of weights. Nothing when ^C came.
  std::optional<EvaluationRecord> evaluate();

 private:
  const Run& run_;
  EvaluationWorlds worlds_;  // kept from one evaluation to the next
};

}  // namespace pictura
