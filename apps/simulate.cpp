// `pictura simulate`: simulates one world with a policy, counts events, and films the world from above and through the
// cameras.
#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <optional>

#include "pictura/apps/commands.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/recording_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/serve_options.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/drawing/drawing.h"
#include "pictura/drawing/film.h"
#include "pictura/driving/recording.h"
#include "pictura/driving/serve.h"
#include "pictura/driving/world.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/simulator/drive_steps.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/simulator/scene_recorder.h"

namespace pictura {

namespace {

struct SimulateArguments {
  WorldOptions world;
  int steps = 300;
  std::string policy = "random", video, replay, mcap, scene;
  RecordingOptions recording;
  ServeOptions serve;
  bool endless = false;  // runs until it is interrupted
  std::optional<int> film_agent;
  float film_width_m = 150;
  bool json = false;
};

std::array<int64_t, kNumAgentClasses> spawned_by_class(Simulator& simulator) {
  const AgentStateView state = simulator.state();
  std::array<int64_t, kNumAgentClasses> counts{};
  for (int slot = 0; slot < simulator.num_slots(); ++slot) {
    counts[static_cast<int>(state.agent_class[slot])] += has_body(state.status[slot]);
  }
  return counts;
}

/// Distances of driven agents from their recorded positions, over all recorded steps of these agents.
struct Displacement {
  int64_t steps = 0;
  double sum_m = 0, max_m = 0;

  void add(Simulator& simulator, const Scenario& scene) {
    const int32_t step = simulator.maps()[0]->start_step + simulator.episode_step()[0];
    for (int32_t track = 0; track < simulator.num_slots() && step < scene.num_steps; ++track) {
      if (simulator.state().status[track] != AgentStatus::active) continue;
      const std::optional<float> apart_m = displacement_m(scene, track, step, simulator.scene().agents[track].center_m);
      if (!apart_m) continue;
      ++steps;
      sum_m += double{*apart_m};
      max_m = std::max(max_m, double{*apart_m});
    }
  }
};

// Rejects options that would have no effect.
void reject_idle_options(const CLI::App& command, const SimulateArguments& arguments) {
  if (arguments.video.empty()) {
    for (const char* option : {"--film-width", "--film-agent"}) {
      if (command.count(option) > 0) fail_usage("{}: has no effect without --video", option);
    }
  }
  if (arguments.replay.empty() && arguments.mcap.empty() && !arguments.serve.is_asked) {
    reject_recording_options(command, "--replay, --mcap or --serve");
  }
  if (!arguments.serve.is_asked && command.count("--serve-host") > 0) {
    fail_usage("--serve-host: has no effect without --serve");
  }
  reject_idle_backend_options(command, arguments.policy);
}

/// Counts agents that entered and left the map, over all episodes, on maps whose roads end. Agents that are present at
/// the start of an episode do not count as entered.
class LifeCounter {
 public:
  void add(const Simulator& simulator) {
    if (!simulator.maps()[0]->rules.is_open) return;
    const SpawnReport now = simulator.spawn_report();
    if (now.left < current_.left) {  // a new episode has begun
      entered_ += current_.entered;
      left_ += current_.left;
    }
    current_ = now;
  }
  int64_t entered() const { return entered_ + current_.entered; }
  int64_t left() const { return left_ + current_.left; }

 private:
  SpawnReport current_;
  int64_t entered_ = 0, left_ = 0;
};

/// Measures the duration of steps. As the last observer, it measures only the simulator.
class StepClock final : public StepObserver {
 public:
  void before_step(Span<const Command>) override { watch_.restart(); }
  void after_step(const StepResult&) override { seconds_ += watch_.seconds(); }
  double seconds() const { return seconds_; }

 private:
  Stopwatch watch_;
  double seconds_ = 0;
};

/// Counts over all steps for the report.
class StepCounter final : public StepObserver {
 public:
  StepCounter(Simulator& simulator, const Scenario* scene) : simulator_(simulator), scene_(scene) {}
  void after_step(const StepResult&) override {
    if (scene_) displacement.add(simulator_, *scene_);
    lives.add(simulator_);
  }

  Displacement displacement;  // for a recorded scene
  LifeCounter lives;

 private:
  Simulator& simulator_;
  const Scenario* const scene_;
};

struct SimulationRun {
  SpawnReport spawned;  // in the first episode, like the counts by class
  std::array<int64_t, kNumAgentClasses> of_class{};
  int steps = 0;
  // Durations: all work except filming, recording and serving; and only the simulator's steps.
  double drive_s = 0, simulate_s = 0;
};

void print_simulation(const SimulationRun& run, const StepCounter& counted, const DrivenWorld& world, bool json) {
  Simulator& simulator = *world.simulator;
  const Scenario* const scene = simulator.maps()[0]->scenario.get();
  const SimulatorTotals& totals = simulator.totals();
  Json object{{"backend", simulator.name()},
              {"renderer", world.renderer ? Json(world.renderer->name()) : Json(nullptr)},
              {"map", simulator.maps()[0]->road->name},
              {"light_heads", name_of(simulator.config().light_heads)},
              {"wall_seed", simulator.config().walls ? Json(simulator.config().wall_seed) : Json(nullptr)},
              {"light_cycles", light_cycles_text(simulator.config(), *simulator.maps()[0])},
              {"asked", run.spawned.asked},
              {"spawned", run.spawned.spawned},
              {"refused", run.spawned.refused},
              {"refused_no_place", run.spawned.refused_no_place},
              {"refused_taken", run.spawned.refused_taken},
              {"entered", counted.lives.entered()},
              {"left", counted.lives.left()},
              {"vehicles", run.of_class[static_cast<size_t>(AgentClass::vehicle)]},
              {"cyclists", run.of_class[static_cast<size_t>(AgentClass::cyclist)]},
              {"pedestrians", run.of_class[static_cast<size_t>(AgentClass::pedestrian)]},
              {"parked_asked", run.spawned.parked_asked},
              {"parked_placed", run.spawned.parked_placed},
              {"steps", run.steps},
              {"agent_steps", totals.agent_steps},
              {"agent_steps_per_s", finite_or_null(static_cast<double>(totals.agent_steps) / run.drive_s)},
              {"slot_steps_per_s", finite_or_null(static_cast<double>(totals.slot_steps) / run.drive_s)},
              {"simulator_agent_steps_per_s", finite_or_null(static_cast<double>(totals.agent_steps) / run.simulate_s)},
              {"episodes", totals.episodes}};
#define X(name, ...) object[#name] = totals.name;
  PICTURA_EVENT_TOTALS(X)
#undef X
  object["km_driven"] = totals.distance_m / 1000;
  object["state_hash"] = fmt::format("{:016x}", simulator.state_hash());
  if (scene) {
    object["scenario_id"] = scene->id;
    object["start_step"] = simulator.maps()[0]->start_step;
    object["displacement_steps"] = counted.displacement.steps;
    object["displacement_mean_m"] =
        finite_or_null(counted.displacement.sum_m / static_cast<double>(counted.displacement.steps));
    object["displacement_max_m"] = counted.displacement.max_m;
  }
  if (json) {
    print_json(object);
  } else {
    for (const auto& [key, value] : object.items()) {
      print_result("{:20} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
}

void run_simulate(SimulateArguments arguments) {
  DrivenWorld world = make_world(arguments.world, arguments.policy);
  Simulator* const simulator = world.simulator.get();
  const Scenario* const scene = simulator->maps()[0]->scenario.get();
  if (arguments.steps == 0) arguments.steps = simulator->config().episode_steps;
  const int film_agent = arguments.film_agent.value_or(world.first_agent);
  if (film_agent >= simulator->num_slots()) {
    fail_usage("--film-agent: expected 0 to {}, got {}", simulator->num_slots() - 1, film_agent);
  }
  resolve_followed(world, &arguments.recording);
  SimulationRun run{.spawned = simulator->spawn_report(), .of_class = spawned_by_class(*simulator)};
  std::unique_ptr<Film> film;
  if (!arguments.video.empty()) {
    film = std::make_unique<Film>(arguments.video, *simulator,
                                  FilmOptions{.agent = film_agent,
                                              .width_m = arguments.film_width_m,
                                              .trained_view = world.trained_view,
                                              .num_threads = arguments.world.num_threads});
  }

  std::unique_ptr<Recording> recording;
  const RecordedDriver driver{arguments.policy, world.session.get(), world.renderer.get()};
  if (!arguments.replay.empty() || !arguments.mcap.empty()) {
    if (!arguments.endless) check_replay_room(simulator->num_slots(), arguments.steps);
    recording = std::make_unique<Recording>(*simulator, driver, arguments.recording);
  }
  std::optional<SceneRecorder> saved;
  if (!arguments.scene.empty()) saved.emplace(*simulator);
  std::unique_ptr<LiveView> live;
  if (arguments.serve.is_asked) live = serve(arguments.serve, *simulator, driver, arguments.recording);

  StepCounter counter(*simulator, scene);
  StepClock clock;
  std::vector<StepObserver*> observers{live.get(), recording.get(), saved ? &*saved : nullptr, &counter, &clock};
  std::erase(observers, nullptr);
  ProgressLine line;
  std::exception_ptr film_failure;
  const auto act = [&](int) {
    if (live && !await_step(*live)) return false;
    try {
      if (film) film->add_frame(*simulator);
    } catch (const Error&) {  // such as a full disk, which must not end the simulation
      film_failure = std::current_exception();
      film.reset();
    }
    const Stopwatch acting;
    world.act();
    run.drive_s += acting.seconds();
    return true;
  };
  const auto on_step = [&](int step, const StepResult&) {
    if (!live)
      line.update(fmt::format("step {}/{}", step + 1, arguments.steps),
                  static_cast<double>(step + 1) / arguments.steps);
  };
  const int most_steps = arguments.endless ? std::numeric_limits<int>::max() : arguments.steps;
  const int steps = run.steps = drive_steps(*simulator, world.commands, most_steps, act, observers, on_step).steps;
  run.simulate_s = clock.seconds();
  run.drive_s += run.simulate_s;
  line.finish();
  if (live) live->finish();
  print_simulation(run, counter, world, arguments.json);
  const auto write_film = [&] {
    if (film_failure) std::rethrow_exception(film_failure);
    if (film && steps > 0) film->close();  // after an early interrupt, there is no frame
  };
  const auto write_scene = [&] {
    if (!saved) return;
    write_scene_file(arguments.scene, saved->scenario());
    print_message("{}: {} steps of the first episode\n", arguments.scene, saved->num_steps() - 1);
  };
  const auto write_recording = [&] {
    if (recording) write_replay_files(recording->finish(), arguments.replay, arguments.mcap);
  };
  call_all({write_film, write_recording, write_scene});
  if (arguments.endless) throw Interrupted(fmt::format("interrupted at step {}", steps));
  if (steps < arguments.steps) throw Interrupted(fmt::format("interrupted at step {} of {}", steps, arguments.steps));
}

}  // namespace

void add_simulate_command(CLI::App& app) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand("simulate", "Drive a world and count what happens");
  add_driving_options(command, &arguments->world, &arguments->steps, &arguments->policy);
  command
      ->add_option("--video", arguments->video,
                   "Film to write (.mp4 or .gif): the world from above, with goals, lights and reasons of halts, "
                   "and one agent's camera images")
      ->check(output_file({".mp4", ".gif"}, Ending::required));
  add_number_option(command, "--film-width", arguments->film_width_m,
                    "Width of the area that the film shows from above, in metres; 0: the whole map", 0, 1e5);
  add_number_option(command, "--film-agent", arguments->film_agent,
                    "Agent that the film follows; default: agent 0, or the self-driving car in recorded scenes", 0);
  command->add_option("--replay", arguments->replay, "Record the world as a page for browsers")
      ->check(output_file({".html"}));
  command->add_option("--mcap", arguments->mcap, "Also write an MCAP file, for Foxglove")
      ->check(output_file({".mcap"}));
  command
      ->add_option("--scene", arguments->scene,
                   "Save the first episode as a recorded scene (*.scenario), with its lights; a replay of the scene is "
                   "bit-exact")
      ->check(output_file({std::string(kSceneFileEnding)}, Ending::required));
  add_serve_options(command, &arguments->serve);
  add_recording_options(command, &arguments->recording);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "agent_steps_per_s includes the simulator, the policy and its images, but not film and replay;\n"
      "simulator_agent_steps_per_s includes only the simulator.\n"
      "Examples:\n  pictura simulate Town01 --agents 80 --steps 600 --policy random --json\n"
      "  pictura simulate procedural:1 --policy runs/demo/checkpoint.ckpt --video drive.mp4\n"
      "  pictura simulate Town05 --agents 60 --policy lane --serve --cameras\n"
      "  pictura simulate validation.tfrecord-00000-of-00150#7 --policy runs/demo/checkpoint.ckpt --control vehicles\n"
      "  pictura simulate procedural:1 --policy lane --scene drive.scenario && pictura simulate drive.scenario");
  command->callback([arguments, command] {
    resolve_driving_options(*command, &arguments->world, &arguments->steps, &arguments->policy);
    reject_idle_options(*command, *arguments);
    arguments->endless = arguments->serve.is_asked && command->count("--steps") == 0;
    run_simulate(*arguments);
  });
}

}  // namespace pictura
