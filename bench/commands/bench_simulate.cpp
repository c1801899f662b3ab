// `pictura bench simulate`: measures step rates of simulators, by backend, number of worlds and agents per world, with
// and without entity sets (observations as vectors). Also draws the cost of an agent-step as a figure.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/bench/commands/bench.h"
#include "pictura/bench/commands/plot_results.h"
#include "pictura/bench/render.h"
#include "pictura/bench/step_rate.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/load_map.h"

namespace pictura {

namespace {

struct SimulateArguments {
  // Only vehicles by default, as in the simulators with which rates are compared. Options set the shares of other
  // classes.
  WorldOptions world = bench_world(/*num_threads=*/1, /*share=*/0, /*parked_cars=*/0);
  std::vector<std::string> maps, backends = {"cpu"};
  int num_worlds = 0, slots = 0;
  std::string sweep;
  int warm_up_steps = 60;
  RateArguments rate;
  std::optional<EarlierReport> earlier;
};

/// Worlds of one simulator, which are measured together.
struct SimulateCase {
  std::string name;  // name of the worlds
  std::vector<WorldSpec> worlds;
  bool vector_observations = true;
};

/// Returns worlds with equal numbers of agents. They use the maps cyclically.
SimulateCase equal_worlds(int num_worlds, int agents, int num_maps) {
  SimulateCase result{.name = fmt::format("{} worlds of {} agents", num_worlds, agents)};
  for (int w = 0; w < num_worlds; ++w) {
    result.worlds.push_back({w % num_maps, agents, static_cast<uint32_t>(w)});
  }
  return result;
}

// Values that sweeps hold fixed.
constexpr int kSweptWorlds = 64, kSweptAgents = 60;

std::vector<SimulateCase> simulate_cases_of(const SimulateArguments& arguments) {
  const int num_maps = static_cast<int>(arguments.maps.size());
  std::vector<SimulateCase> cases;
  if (arguments.sweep == "agents") {
    for (int agents = 1; agents <= 1024; agents *= 4) cases.push_back(equal_worlds(kSweptWorlds, agents, num_maps));
  } else if (arguments.sweep == "worlds") {
    for (int worlds = 1; worlds <= 4096; worlds *= 4) cases.push_back(equal_worlds(worlds, kSweptAgents, num_maps));
  } else if (arguments.sweep == "crowd") {
    for (const int agents : kCrowds) cases.push_back(equal_worlds(1, agents, num_maps));
  } else {
    SimulateCase both =
        equal_worlds(arguments.num_worlds > 0 ? arguments.num_worlds : num_maps, arguments.world.agents, num_maps);
    if (arguments.slots > 0) {
      both.worlds = draw_worlds(arguments.world.seed, arguments.slots, 1, arguments.world.agents, num_maps);
      both.name = fmt::format("{} agents in worlds of 1 to {}", arguments.slots, arguments.world.agents);
    }
    cases.push_back(both);
    both.vector_observations = false;
    both.name += " without entity sets";
    cases.push_back(both);
  }
  return cases;
}

/// Takes some steps with `simulator` and with the CPU simulator. Throws Error unless both reach bitwise identical
/// states.
void check_against_oracle(const SimulatorConfig& config, const CompiledMaps& maps, const std::vector<WorldSpec>& worlds,
                          Simulator* simulator, StepBench* bench) {
  constexpr int64_t kSteps = 16;
  const auto oracle = make_simulator("cpu", config, maps, worlds);
  StepBench(oracle.get(), config.seed).run(kSteps);
  bench->run(kSteps);
  PICTURA_CHECK(simulator->state_hash() == oracle->state_hash(),
                "simulate: after {} steps the state of {} differs from the CPU's", kSteps, simulator->name());
}

void measure(const SimulateArguments& arguments, const std::string& backend, const CompiledMaps& maps,
             const SimulateCase& measured, std::vector<BenchResult>* results_out) {
  const WorldOptions& world = arguments.world;
  SimulatorConfig config;
  apply_world_options(world, &config);
  config.vector_observations = measured.vector_observations;
  const auto simulator = make_simulator(backend, config, maps, measured.worlds);
  StepBench bench(simulator.get(), world.seed);
  if (!simulator->device().is_host()) check_against_oracle(config, maps, measured.worlds, simulator.get(), &bench);
  const StepTiming warm_up = bench.run(arguments.warm_up_steps);
  const double steps_per_s = static_cast<double>(warm_up.steps) / warm_up.elapsed_s;
  const int64_t steps = std::max<int64_t>(1, static_cast<int64_t>(arguments.rate.repeat_s * steps_per_s));
  const std::string name = fmt::format("{}, {}", backend, measured.name);
  BenchResult live{name, "agent_steps_per_s", {}}, slots{name + ", slots", "slot_steps_per_s", {}},
      step{name + ", one step", "ms", {}};
  for (int repeat = 0; repeat < arguments.rate.repeats; ++repeat) {
    throw_if_interrupted();
    const StepTiming timing = bench.run(steps);
    live.values.push_back(static_cast<double>(timing.agent_steps) / timing.elapsed_s);
    slots.values.push_back(static_cast<double>(timing.slot_steps) / timing.elapsed_s);
    step.values.push_back(1e3 * timing.elapsed_s / static_cast<double>(timing.steps));
  }
  results_out->insert(results_out->end(), {live, slots, step});
}

void run_simulate(SimulateArguments arguments) {
  if (has_plot_arguments(arguments.rate.plot)) return draw_results("step_costs", arguments.rate.plot);
  check_backends(arguments.backends, simulator_names());
  arguments.maps = named_maps(arguments.maps);
  std::vector<std::shared_ptr<const RoadMap>> maps;
  for (const std::string& name : arguments.maps) maps.push_back(load_map(name));
  const CompiledMaps compiled = compile_maps(maps, {.walls = arguments.world.walls}, arguments.world.num_threads);
  std::vector<BenchResult> results;
  ProgressLine progress;
  bool on_device = false;
  for (const std::string& backend : arguments.backends) {
    on_device = on_device || backend == "cuda";
    for (const SimulateCase& measured : simulate_cases_of(arguments)) {
      progress.update(fmt::format("{}, {}", backend, measured.name));
      measure(arguments, backend, compiled, measured, &results);
    }
  }
  progress.finish();
  BenchContext context{
      .workload = fmt::format("simulate: {}, {}, walls {}, random actions with resets, {} threads",
                              fmt::join(arguments.maps, " "),
                              arguments.sweep == "crowd" ? population_of_crowds() : population_of(arguments.world),
                              arguments.world.walls ? "on" : "off", arguments.world.num_threads),
      .backend = fmt::format("{}", fmt::join(arguments.backends, ","))};
  if (on_device) context.add_gpu(cuda_device_name(), cuda_driver_name());
  report_benchmark(arguments.rate.json, context, results, arguments.earlier);
}

}  // namespace

void add_simulate_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = bench.add_subcommand("simulate", "Steps of worlds, including observations");
  add_maps_option(command, &arguments->maps);
  add_world_options(command, &arguments->world);
  command->add_option("--backend", arguments->backends, "cpu, cuda")->delimiter(',')->capture_default_str();
  auto* worlds = add_number_option(command, "--worlds", arguments->num_worlds, "Number of worlds; default: one per map",
                                   1, kMaxSlots);
  auto* slots =
      add_number_option(command, "--slots", arguments->slots,
                        "Total number of agents, in worlds of 1 to --agents, as in training, instead of equal worlds",
                        1, kMaxSlots)
          ->excludes(worlds);
  command
      ->add_option(
          "--sweep", arguments->sweep,
          fmt::format("agents: {} worlds of 1 to 1,024; worlds: 1 to 4,096 of {} agents; crowd: one of 256 to 4,096",
                      kSweptWorlds, kSweptAgents))
      ->check(one_of({"agents", "worlds", "crowd"}).description("{agents,worlds,crowd}"))
      ->excludes(worlds)
      ->excludes(slots);
  add_number_option(command, "--warm-up", arguments->warm_up_steps, "Steps before timing", 1);
  add_rate_options(command, &arguments->rate);
  add_compare_option(command, &arguments->earlier);
  command->footer(
      "Examples:\n  pictura bench simulate --map Town01 --agents 120 --json > before.json\n"
      "  pictura bench simulate --map Town01 --agents 120 --compare before.json\n"
      "  pictura bench simulate --map procedural:1 --pedestrians 0.1 --cyclists 0.1\n"
      "  pictura bench simulate --backend cuda --map towns --slots 20480 --pedestrians 0.1 --cyclists 0.1 --parked 32");
  command->callback([arguments] { run_simulate(*arguments); });
}

}  // namespace pictura
