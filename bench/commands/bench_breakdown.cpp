// `pictura bench breakdown`: measures how an update's time divides into phases, by image size and renderer. The Pictura
// paper has the same breakdown (section 4, figure and appendix "Training-Step Time Breakdown"). Also draws the figure.
#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/bench/commands/bench.h"
#include "pictura/bench/commands/measure_training.h"
#include "pictura/bench/commands/plot_results.h"
#include "pictura/bench/render.h"
#include "pictura/bench/step_rate.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/configuration/config.h"
#include "pictura/map/load_map.h"

namespace pictura {

namespace {

constexpr int kNumWorlds = 2;

struct BreakdownArguments {
  TrainingCase measured{.config_path = "configs/paper.toml"};
  std::vector<std::string> backends = {"cuda"}, samples = {"1"},
                           sizes = {"32x18", "64x36", "96x54", "192x108", "384x216"};
  // The paper's text has two readings. With 256 agents per world, an update fills a minibatch of 65,536; with 128 per
  // world, it fills half of it.
  std::vector<int> agents = {256, 128};
  std::string device = "auto", simulator = "auto";
  int chunk = 2048, checked_views = 8;
  bool host_steps = false, json = false;
  PlotArguments plot;
};

// Seconds of an update in the paper, on an H100 NVL.
struct PaperRow {
  const char* size;
  double env, rendering, forward, optimisation, other, total;
};
constexpr PaperRow kPaperRows[] = {{"32x18", 6.93, 0.84, 0.60, 0.53, 0.28, 9.17},
                                   {"64x36", 6.90, 0.94, 0.75, 0.80, 0.27, 9.65},
                                   {"96x54", 6.89, 1.06, 0.98, 1.15, 0.27, 10.35},
                                   {"192x108", 6.93, 1.99, 2.68, 3.57, 0.28, 15.45},
                                   {"384x216", 6.92, 3.88, 9.44, 14.08, 0.30, 34.61}};

// Columns of the paper's table. "policy forward" contains every forward pass of the network, in the rollout and in
// learning. "optimization" contains the rest of learning: gradients and the optimizer's steps.
struct Column {
  const char* name;
  double (*value)(const UpdateCost& cost);
};
constexpr Column kColumns[] = {
    {"env", [](const UpdateCost& cost) { return phase_s(cost, Phase::simulate); }},
    {"rendering", [](const UpdateCost& cost) { return phase_s(cost, Phase::render); }},
    {"forward", [](const UpdateCost& cost) { return phase_s(cost, Phase::forward) + phase_s(cost, Phase::learn); }},
    {"optimisation",
     [](const UpdateCost& cost) { return phase_s(cost, Phase::backward) + phase_s(cost, Phase::optimize); }},
    {"diagnosis", [](const UpdateCost& cost) { return phase_s(cost, Phase::diagnose); }},
    {"other", other_s},
    {"total", wall_s}};

struct BreakdownCase {
  std::string backend, samples, size;
  int agents = 0;
  // Name of the renderer. For gl, it includes the number of samples.
  std::string renderer() const { return backend.starts_with("gl") ? backend + " " + samples : backend; }
  std::string name() const { return fmt::format("{} {} {} agents a world", renderer(), size, agents); }
};

// Configuration of an update with all transitions in one minibatch: one epoch, no advantage filter, and every slot at
// every step.
std::vector<std::string> recipe_of(const BreakdownArguments& arguments) {
  std::vector<std::string> texts{"train.num_steps=128",
                                 "train.update_epochs=1",
                                 "train.minibatch_size=4294967296",
                                 "train.adv_filter_threshold=0",
                                 "train.halted_slots=draw",
                                 "simulator.maps=[\"Town01\", \"Town02\"]",
                                 "run.device=" + arguments.device,
                                 "simulator.backend=" + arguments.simulator};
  texts.insert(texts.end(), arguments.measured.overrides.begin(), arguments.measured.overrides.end());
  return texts;
}

std::vector<std::string> overrides_of(const BreakdownArguments& arguments, const BreakdownCase& c, int64_t chunk) {
  const Pair pixels = parse_pair("--size", c.size, 8192);
  std::vector<std::string> texts = recipe_of(arguments);
  for (const std::string& text :
       {fmt::format("simulator.num_slots={}", kNumWorlds * c.agents), fmt::format("simulator.min_agents={}", c.agents),
        fmt::format("simulator.max_agents={}", c.agents), fmt::format("render.width_px={}", pixels.first),
        fmt::format("render.height_px={}", pixels.second), fmt::format("render.backend=\"{}\"", c.backend),
        fmt::format("render.samples=\"{}\"", c.backend.starts_with("gl") ? c.samples : "1"),
        fmt::format("train.forward_chunk={}", chunk)}) {
    texts.push_back(text);
  }
  return texts;
}

// Returns all cases. All arguments are checked here, so that errors are reported before the first case is measured.
std::vector<BreakdownCase> breakdown_cases_of(const BreakdownArguments& arguments) {
  std::vector<BreakdownCase> cases;
  for (const std::string& backend : arguments.backends) {
    for (const std::string& samples : arguments.samples) {
      if (!backend.starts_with("gl") && samples != arguments.samples.front()) continue;
      parse_samples("--samples", samples);
      for (const int agents : arguments.agents) {
        for (const std::string& size : arguments.sizes) {
          cases.push_back({backend, samples, size, agents});
          load_config(arguments.measured.config_path, overrides_of(arguments, cases.back(), arguments.chunk));
        }
      }
    }
  }
  return cases;
}

// Compares images of this renderer and size with those of the CPU renderer, see measure_render().
ImageError check_images(const BreakdownArguments& arguments, const Config& config, const DrivenWorlds& worlds) {
  RenderCase checked{.backend = config.render.backend,
                     .num_views = static_cast<int>(worlds.views.size()),
                     .checked_views = arguments.checked_views,
                     .repeats = 0};
  checked.num_views = std::min(checked.num_views, arguments.checked_views);
  checked.config = renderer_config(config, rig_of(config));
  const bool is_on_device = (checked.backend == "cuda" || checked.backend == "gl:egl") && config.run.device != "cpu" &&
                            !cuda_device_name().empty();
  if (is_on_device) checked.config.device = {MemorySpace::cuda, 0};
  return measure_render(worlds, checked).error;
}

// Measures with the largest chunk that fits into the device's memory. It tries the given chunk, then half of it, then a
// quarter, and so on.
TrainingMeasurement measure_with_largest_chunk(const BreakdownArguments& arguments, const BreakdownCase& c,
                                               int64_t* chunk_out) {
  for (int64_t chunk = arguments.chunk;; chunk /= 2) {
    TrainingCase measured = arguments.measured;
    measured.overrides = overrides_of(arguments, c, chunk);
    *chunk_out = chunk;
    try {
      return measure_training(measured);
    } catch (const OutOfMemory&) {
      if (chunk == 1) throw;
    }
  }
}

// Measures only the simulator's steps of an update, on the host, with random actions and without copies to a device.
BenchResult measure_host_steps(const BreakdownArguments& arguments, const BreakdownCase& c) {
  const Config config = load_config(arguments.measured.config_path, overrides_of(arguments, c, arguments.chunk));
  std::vector<std::shared_ptr<const RoadMap>> maps;
  for (const std::string& map : config.simulator.maps) maps.push_back(load_map(map));
  const auto simulator = make_simulator(
      "cpu", simulator_config(config), maps,
      draw_worlds(config.run.seed, kNumWorlds * c.agents, c.agents, c.agents, static_cast<int>(maps.size())));
  StepBench bench(simulator.get(), config.run.seed);
  bench.run(config.train.num_steps);
  BenchResult result{fmt::format("simulator on the host, {} agents a world, env", c.agents), "s", {}};
  for (int i = 0; i < arguments.measured.updates; ++i) {
    result.values.push_back(bench.run(config.train.num_steps).elapsed_s);
  }
  return result;
}

void print_table_head() {
  print_result("Seconds, medians; the paper's, on an H100 NVL, after |.\n{:36}", "");
  for (const Column& column : kColumns) print_result(" {:>12}", column.name);
  print_result("  {:^20} {:>7} | {:>9} {:>7}\n", "(min to max)", "chunk", "rendering", "total");
}

void print_table_row(const BreakdownCase& c, const std::vector<BenchResult>& columns, int64_t chunk) {
  print_result("{:36}", c.name());
  for (const BenchResult& column : columns) print_result(" {:>12.4g}", summary_of(column)["value"].get<double>());
  const Json total = summary_of(columns.back());
  print_result("  {:^20} {:>7}",
               fmt::format("({:.4g} to {:.4g})", total["min"].get<double>(), total["max"].get<double>()), chunk);
  for (const PaperRow& row : kPaperRows) {
    if (c.size == row.size) print_result(" | {:>9} {:>7}", row.rendering, row.total);
  }
  print_result("\n");
}

/// Returns the columns of the table, with the paper's seconds.
Json breakdown_request() {
  Json parts = Json::array(), paper = Json::object();
  for (const Column& column : kColumns) parts.push_back(column.name);
  for (const PaperRow& row : kPaperRows) paper[row.size] = {{"total", row.total}, {"rendering", row.rendering}};
  return {{"parts", parts}, {"paper", paper}};
}

void run_breakdown(const BreakdownArguments& arguments) {
  if (has_plot_arguments(arguments.plot)) return draw_results("breakdown_parts", arguments.plot, breakdown_request());
  const std::vector<BreakdownCase> cases = breakdown_cases_of(arguments);
  const Config first =
      load_config(arguments.measured.config_path, overrides_of(arguments, cases.front(), arguments.chunk));
  std::vector<std::string> maps = first.simulator.maps;
  maps.resize(std::min<std::size_t>(maps.size(), kNumWorlds));
  ProgressLine progress;
  progress.update("driving");
  std::optional<DrivenWorlds> worlds;
  if (arguments.checked_views > 0) {
    DrivenOptions driven{.maps = maps, .agents = 60};
    driven.simulator.seed = first.run.seed;
    worlds = drive_worlds(driven);
  }

  BenchContext context;
  std::vector<BenchResult> results;
  const std::string workload = fmt::format(
      "breakdown: {}, {} worlds on {}, {} steps, {} epochs, one minibatch, every slot drawn and encoded at every step, "
      "after a warm-up of {}{}",
      arguments.measured.config_path, kNumWorlds, fmt::join(maps, " "), first.train.num_steps,
      first.train.update_epochs, arguments.measured.warm_up,
      arguments.measured.overrides.empty() ? ""
                                           : fmt::format("; --set {}", fmt::join(arguments.measured.overrides, " ")));
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const BreakdownCase& c = cases[i];
    progress.update(c.name(), static_cast<double>(i) / static_cast<double>(cases.size()));
    ImageError error;
    if (worlds) {
      const Config config = load_config(arguments.measured.config_path, overrides_of(arguments, c, arguments.chunk));
      error = check_images(arguments, config, *worlds);
    }
    int64_t chunk = 0;
    const TrainingMeasurement measurement = measure_with_largest_chunk(arguments, c, &chunk);
    if (i == 0) {
      TrainReport report = measurement.report;
      report.renderer = fmt::format("{}", fmt::join(arguments.backends, ","));
      context = training_context(workload, report);
    }
    std::vector<BenchResult> columns;
    for (const Column& column : kColumns) {
      columns.push_back(result_of(measurement, fmt::format("{}, {}", c.name(), column.name), "s", column.value));
    }
    if (!arguments.json) {
      progress.finish();
      if (i == 0) print_heading(context), print_table_head();
      print_table_row(c, columns, chunk);
    }
    results.insert(results.end(), columns.begin(), columns.end());
    results.push_back({c.name() + ", chunk", "transitions", {static_cast<double>(chunk)}});
    if (measurement.report.device_bytes > 0) {
      results.push_back(
          {c.name() + ", device memory in use", "GB", {static_cast<double>(measurement.report.device_bytes) / 1e9}});
    }
    if (error.values > 0) {
      const double share = static_cast<double>(error.differing) / static_cast<double>(error.values);
      results.push_back({c.name() + ", values unlike the oracle's", "%", {100 * share}});
    }
  }
  if (arguments.host_steps) {
    for (const int agents : arguments.agents) {
      BreakdownCase c = cases.front();
      c.agents = agents;
      results.push_back(measure_host_steps(arguments, c));
      const Json row = summary_of(results.back());
      if (!arguments.json) {
        print_result("{:36} {:>12.4g}  ({:.4g} to {:.4g})\n", results.back().name, row["value"].get<double>(),
                     row["min"].get<double>(), row["max"].get<double>());
      }
    }
  }
  progress.finish();
  if (arguments.json) report_benchmark(true, context, results);
}

}  // namespace

void add_breakdown_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<BreakdownArguments>();
  TrainingCase& measured = arguments->measured;
  CLI::App* command = bench.add_subcommand(
      "breakdown", "Time of the parts of an update, by size and renderer, next to the paper's table");
  command->add_option("--config", measured.config_path, "TOML file")->capture_default_str();
  command
      ->add_option("--set", measured.overrides,
                   "Override a key, for instance simulator.maps=[\"Town02\"]; may be given several times")
      ->allow_extra_args(false);
  command->add_option("--backend", arguments->backends, "Renderers: cpu, cuda, gl:egl, gl:osmesa, null")
      ->delimiter(',')
      ->capture_default_str();
  command
      ->add_option("--samples", arguments->samples,
                   "Samples per pixel of the renderer gl: 1, N (MSAA) or NxN (supersampling)")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--size", arguments->sizes, "Sizes in pixels, WxH; default: the paper's five")->delimiter(',');
  command
      ->add_option("--agents", arguments->agents,
                   "Agents of each of the two worlds; default: both readings of the paper")
      ->delimiter(',')
      ->transform(whole_number(1, kMaxAgentsPerWorld))
      ->capture_default_str();
  add_number_option(command, "--chunk", arguments->chunk,
                    "Transitions per network pass, fewer if memory does not suffice", 1, 1 << 30);
  command->add_option("--device", arguments->device, "Device of the network: cpu, cuda, cuda:N, auto")
      ->check(device_name())
      ->capture_default_str();
  command->add_option("--simulator", arguments->simulator, "cpu, cuda, auto")->capture_default_str();
  command->add_flag("--host-steps", arguments->host_steps,
                    "Also time the simulator steps of an update on the host, separately");
  add_number_option(command, "--warm-up", measured.warm_up, "Updates before the measured updates, in each case", 1);
  add_number_option(command, "--updates", measured.updates, "Measured updates", 1);
  add_number_option(command, "--check", arguments->checked_views,
                    "Number of egos whose images are compared with the oracle's before each case", 0);
  add_plot_options(command, "Plot these results instead of measuring", &arguments->plot);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Examples:\n  pictura bench breakdown --host-steps --json\n"
      "  pictura bench breakdown --backend gl:egl --samples 1,2x2 --size 96x54 --agents 256 --updates 1\n"
      "  pictura bench breakdown --plot RESULTS.json --figure breakdown.png");
  command->callback([arguments, command] {
    if (!has_plot_arguments(arguments->plot)) check_default_config(*command, arguments->measured.config_path);
    run_breakdown(*arguments);
  });
}

}  // namespace pictura
