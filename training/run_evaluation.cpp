#include "pictura/training/run_evaluation.h"

#include "pictura/backends/upload_maps.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/policy/session.h"

namespace pictura {

RunEvaluation::RunEvaluation(const Run& run) : run_(run) {
  if (run.config.simulator.has_scenes()) return;  // parse_config() refuses evaluations with scenes
  // Copies of maps follow the maps themselves, and are left out.
  const CompiledMaps& maps = run.simulator->maps();
  worlds_.maps.assign(maps.begin(), maps.begin() + static_cast<ptrdiff_t>(run.config.simulator.maps.size()));
}

bool RunEvaluation::is_due() const {
  const int64_t every = run_.config.train.evaluate_every;
  return every > 0 && run_.update > 0 && run_.update % every == 0;
}

std::optional<EvaluationRecord> RunEvaluation::evaluate() {
  const Stopwatch watch;
  const Config& config = run_.in_force;
  EvaluateOptions options;
  options.maps = config.simulator.maps;
  options.scenarios = config.train.evaluate_scenarios;
  options.agents_per_world = config.train.evaluate_agents;
  options.steps = config.train.evaluate_steps;
  options.num_threads = config.run.num_threads;
  options.simulator = run_.simulator->name();
  // Both simulators use the handles 0, 1, ... for their maps, so the uploaded training maps also fit the evaluation's
  // scenes.
  worlds_.renderer = run_.renderer.get();
  PolicySession session(config, run_.rig, run_.device, *run_.policy);
  std::unique_ptr<Renderer> as_mounted;
  if (worlds_.renderer && config.render.randomization.is_on()) {
    as_mounted = session.make_renderer();
    upload_maps(worlds_.maps, {}, as_mounted.get());
    worlds_.renderer = as_mounted.get();
  }
  const EvaluateReport report = pictura::evaluate(&session, options, &worlds_);
  if (report.interrupted) return std::nullopt;
  EvaluationRecord record{report.rows.at(0), {}, 0, run_.image_size()};
  if (run_.average) {
    const ReplacedWeights averaged(*run_.policy, run_.average->values);
    const EvaluateReport of_average = pictura::evaluate(&session, options, &worlds_);
    if (of_average.interrupted) return std::nullopt;
    record.average_row = of_average.rows.at(0);
  }
  record.seconds = watch.seconds();
  return record;
}

}  // namespace pictura
