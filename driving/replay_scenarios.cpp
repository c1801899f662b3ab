#include "pictura/driving/replay_scenarios.h"

#include <algorithm>
#include <array>
#include <optional>

#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/messages.h"
#include "pictura/evaluation/probes/driven_scenes.h"
#include "pictura/policy/session.h"
#include "pictura/simulator/drive_steps.h"
#include "pictura/simulator/saved_worlds.h"

namespace pictura {

namespace {

class ScenarioRecorder final : public EvaluationObserver {
 public:
  ScenarioRecorder(RecordedDriver driver, const RecordingOptions& options)
      : driver_(std::move(driver)), options_(options) {}

  void begin(Simulator& simulator) override {
    if (driver_.renderer) upload_maps(simulator, driver_.renderer);
    recording_.emplace(simulator, driver_, options_);
  }
  void before_step(Span<const Command> commands) override { recording_->before_step(commands); }
  void after_step(const StepResult& result) override { recording_->after_step(result); }
  Replay finish(std::vector<int32_t>* agent_of_out) { return recording_->finish(agent_of_out); }

 private:
  const RecordedDriver driver_;
  RecordingOptions options_;
  std::optional<Recording> recording_;
};

// Observer that records the states of all agents of the only world, and saves a copy of the world after `step` steps.
class ScenarioKeeper final : public EvaluationObserver {
 public:
  explicit ScenarioKeeper(int step) : step_(step) {}

  void begin(Simulator& simulator) override { simulator_ = &simulator; }
  void before_step(Span<const Command>) override {
    scenes_.add(*simulator_, 0);
    if (steps_++ == step_) kept_ = extract_worlds(*simulator_, simulator_->save(), {0})[0];
  }

  const DrivenScene& scene(int number) const { return scenes_.of(number); }
  const SavedWorld* kept() const { return kept_.get(); }

 private:
  const int step_;
  int steps_ = 0;
  Simulator* simulator_ = nullptr;
  DrivenScenes scenes_;
  std::shared_ptr<const SavedWorld> kept_;
};

// Returns options of an evaluation of one scenario on the host.
EvaluateOptions options_of(const EvaluateOptions& options, const RecordedScenario& scenario) {
  EvaluateOptions one = options;
  one.agents_per_world = scenario.agents_per_world;
  one.maps = {options.maps[static_cast<size_t>(scenario.number) % options.maps.size()]};
  one.first_scenario = scenario.number;
  one.scenarios = 1;
  one.device = one.simulator = "cpu";
  one.on_progress = nullptr;
  return one;
}

// Evaluates the driver in the world configuration of another policy, with the observations that the driver reads.
EvaluateReport evaluate_in_world_of(const std::string& path, PolicySession* driver, const EvaluateOptions& options) {
  const SimulatorConfig its = driver->evaluation_world(options.steps);
  SimulatorConfig world = PolicySession(path, options).evaluation_world(options.steps);
  world.seed = options.seed;
  world.vector_observations = its.vector_observations;
  world.wall_observations = its.wall_observations;
  world.auxiliary_observations = its.auxiliary_observations;
  EvaluationWorlds worlds{.maps = compile_maps_of(options, world)};
  const std::unique_ptr<Renderer> renderer = driver->make_renderer();
  worlds.renderer = renderer.get();
  if (renderer) upload_maps(worlds.maps, {}, renderer.get());
  worlds.simulator = make_simulator(options.simulator, world, worlds.maps, {{0, 1, kFirstEvaluationWorld}});
  return evaluate(driver, options, &worlds);
}

// Returns a session of the policy that drives, or null if a controller drives.
std::unique_ptr<PolicySession> session_of(const EvaluateOptions& options) {
  if (!options.controller.empty()) return nullptr;
  return std::make_unique<PolicySession>(options.checkpoint, options);
}

// Simulates the scenario, and returns its counts. `session` is the result of session_of().
ScenarioCounts drive(const EvaluateOptions& options, const RecordedScenario& scenario, PolicySession* session) {
  EvaluateOptions one = options;
  if (!session && !scenario.world_of.empty()) one.checkpoint = scenario.world_of;
  const EvaluateReport report = !session                    ? evaluate(one)
                                : scenario.world_of.empty() ? evaluate(session, one)
                                                            : evaluate_in_world_of(scenario.world_of, session, one);
  if (report.interrupted) throw Interrupted("interrupted while a scenario was recorded");
  return report.results.densities[0].scenarios[0];
}

// Returns a sort key that is larger for worse scenarios: the share of vehicles with infractions at fault, then the
// share with collisions at fault, then the negative distance driven.
std::array<double, 3> severity_key(const ScenarioCounts& counts) {
  const auto vehicles = static_cast<double>(std::max<int64_t>(1, counts.vehicles));
  return {static_cast<double>(counts.at_fault_infraction) / vehicles, static_cast<double>(counts.at_fault) / vehicles,
          -counts.distance_m / vehicles};
}

const ScenarioCounts& counts_of(const EvaluationResults& results, const ScenarioPlace& place) {
  const DensityResult& density = results.densities[place.density];
  return density.scenarios[place.scenario - density.first_scenario];
}

// Returns the recording options. If no followed agent was requested and the evaluation has found the scenario's worst
// agent, the recording follows that agent.
RecordingOptions following_worst(RecordingOptions recording, const EvaluationResults& results,
                                 const ScenarioPlace& place) {
  const DensityResult& density = results.densities[place.density];
  const auto index = static_cast<size_t>(place.scenario - density.first_scenario);
  if (!recording.followed && index < density.worst_agents.size()) recording.followed = density.worst_agents[index];
  return recording;
}

void write(const EvaluateOptions& options, const EvaluationResults& results, const RecordingOptions& recording,
           const ScenarioPlace& place, const std::string& path) {
  if (interrupted()) throw Interrupted("interrupted before all replays were written");
  ScenarioCounts counts;
  const RecordedScenario scenario{.number = place.scenario,
                                  .agents_per_world = results.densities[place.density].agents_per_world};
  write_replay_with_message(path,
                            record_scenario(options, scenario, following_worst(recording, results, place), &counts));
  const ScenarioCounts& evaluated = counts_of(results, place);
  if (counts.any_infraction == evaluated.any_infraction && counts.goals == evaluated.goals) return;
  print_message(
      "notice: {}: {} infractions and {} goals, in the evaluation {} and {}: the policy's numbers differ in their last "
      "bits between batch sizes and devices\n",
      path, counts.any_infraction, counts.goals, evaluated.any_infraction, evaluated.goals);
}

}  // namespace

std::vector<ScenarioPlace> worst_scenarios(const EvaluationResults& results, int count) {
  std::vector<ScenarioPlace> places;
  for (size_t density = 0; density < results.densities.size(); ++density) {
    const DensityResult& result = results.densities[density];
    for (size_t i = 0; i < result.scenarios.size(); ++i) {
      places.push_back({density, result.first_scenario + static_cast<int>(i)});
    }
  }
  std::stable_sort(places.begin(), places.end(), [&](const ScenarioPlace& a, const ScenarioPlace& b) {
    return severity_key(counts_of(results, a)) > severity_key(counts_of(results, b));
  });
  places.resize(std::min(places.size(), static_cast<size_t>(count)));
  return places;
}

Replay record_scenario(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordingOptions& recording, ScenarioCounts* counts_out,
                       std::vector<int32_t>* agent_of_out) {
  EvaluateOptions one = options_of(options, scenario);
  const std::unique_ptr<PolicySession> session = session_of(one);
  // The policy's responses for the followed agent need a separate renderer that has the scenario's map.
  std::unique_ptr<Renderer> renderer = session ? session->make_renderer() : nullptr;
  ScenarioRecorder recorder({session ? one.checkpoint : one.controller, session.get(), renderer.get()}, recording);
  one.observer = &recorder;
  *counts_out = drive(one, scenario, session.get());
  return recorder.finish(agent_of_out);
}

Replay record_takeover(const EvaluateOptions& options, const RecordedScenario& scenario,
                       const RecordedTakeover& takeover, const RecordingOptions& recording) {
  EvaluateOptions one = options_of(options, scenario);
  ScenarioKeeper keeper(takeover.step);
  one.observer = &keeper;
  drive(one, scenario, session_of(one).get());
  if (!keeper.kept()) fail("scenario {} ended before step {}", scenario.number, takeover.step);
  const DrivenScene& scene = keeper.scene(scenario.number);

  auto session = std::make_unique<PolicySession>(takeover.policy, one);
  if (takeover.untrained) session = session->make_untrained(one.seed);
  SimulatorConfig world = session->evaluation_world(one.steps);
  world.seed = one.seed;
  const std::unique_ptr<Simulator> simulator =
      make_simulator(one.simulator, world, compile_maps_of(one, world), {scene.world});
  simulator->restore(saved_state_of(*simulator, {keeper.kept()}));
  const std::unique_ptr<Renderer> renderer = session->make_renderer();
  if (renderer) upload_maps(*simulator, renderer.get());
  RecordingOptions followed = recording;
  followed.followed = takeover.agent;
  Recording recorded(*simulator, {takeover.policy, session.get(), renderer.get()}, followed);
  const std::unique_ptr<PolicyController> controller = session->make_controller(renderer.get(), one.argmax, one.seed);
  std::vector<uint8_t> mask(static_cast<size_t>(simulator->num_slots()));
  mask[takeover.agent] = 1;
  std::vector<Command> commands(mask.size());
  const auto act = [&](int step) {
    scene.command_places(takeover.step + step + 1, commands.data());
    controller->act(simulator->arrays(), mask, commands);
    return controller->num_driven() > 0;
  };
  if (drive_steps(*simulator, commands, takeover.steps, act, {&recorded}).is_interrupted)
    throw Interrupted("interrupted while a takeover was recorded");
  return recorded.finish();
}

void write_scenario_replays(const EvaluateOptions& options, const EvaluationResults& results,
                            const RecordingOptions& recording, int count, const std::string& folder) {
  FilledFolder pages(folder, "gallery");
  for (const ScenarioPlace& place : worst_scenarios(results, count)) {
    write(options, results, recording, place,
          pages.file(fmt::format("{}_{}.html", results.densities[place.density].density, place.scenario)));
  }
  write_index(&pages);
}

void write_scenario_replay(const EvaluateOptions& options, const EvaluationResults& results,
                           const RecordingOptions& recording, const std::string& path) {
  for (const ScenarioPlace& place : worst_scenarios(results, 1)) write(options, results, recording, place, path);
}

}  // namespace pictura
