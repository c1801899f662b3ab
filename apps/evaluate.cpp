// `pictura evaluate`: the paper's five driving metrics of a checkpoint, by traffic density.
#include "pictura/training/evaluation/evaluate.h"

#include "pictura/apps/commands.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

namespace {

const std::map<std::string, Density> kDensities{
    {"light", Density::light}, {"medium", Density::medium}, {"dense", Density::dense}};

void print_table(const std::vector<EvaluateRow>& rows) {
  fmt::print("{:10} {:>9} {:>6} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "density", "scenarios", "steps",
             "vehicles", "at-fault", "off-road", "red light", "goals", "km/infr.", "km");
  for (const EvaluateRow& row : rows) {
    fmt::print("{:10} {:>9} {:>6} {:>9} {:>9.4f} {:>9.4f} {:>9.4f} {:>9.3f} {:>9.3f} {:>9.2f}\n", row.density,
               row.scenarios, row.steps, row.vehicle_episodes, row.at_fault_collision_rate, row.off_road_rate,
               row.red_light_rate, row.goals_per_vehicle, row.km_per_infraction, row.km_driven);
  }
}

void print_report(const EvaluateOptions& options, const EvaluateReport& report) {
  Json table = Json::array();
  for (const EvaluateRow& row : report.rows) {
    table.push_back({{"density", row.density},
                     {"scenarios", row.scenarios},
                     {"steps", row.steps},
                     {"vehicle_episodes", row.vehicle_episodes},
                     {"at_fault_collision_rate", finite_or_null(row.at_fault_collision_rate)},
                     {"off_road_rate", finite_or_null(row.off_road_rate)},
                     {"red_light_rate", finite_or_null(row.red_light_rate)},
                     {"goals_per_vehicle", finite_or_null(row.goals_per_vehicle)},
                     {"km_per_infraction", finite_or_null(row.km_per_infraction)},
                     {"km_driven", row.km_driven},
                     {"waypoints_per_vehicle", finite_or_null(row.waypoints_per_vehicle)},
                     {"return_per_vehicle", finite_or_null(row.return_per_vehicle)}});
  }
  print_json({{"checkpoint", options.checkpoint},
              {"argmax", options.argmax},
              {"seed", options.seed},
              {"interrupted", report.interrupted},
              {"rows", table}});
}

}  // namespace

void add_evaluate_command(CLI::App& app) {
  struct Arguments {
    EvaluateOptions evaluate;
    BackendOptions backends;
    std::vector<std::string> densities{"light", "medium", "dense"};
    std::string size;
    bool sampled = false, json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  EvaluateOptions& options = arguments->evaluate;
  options.maps = {"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
  CLI::App* command = app.add_subcommand("evaluate", "Measure a policy's driving (the paper's in-domain protocol)");
  command->add_option("CHECKPOINT", options.checkpoint, "A checkpoint that train wrote")->required();
  command->add_option("--map", options.maps, "Maps that the scenarios are spread over")->capture_default_str();
  command->add_option("--density", arguments->densities, "light, medium, dense: 60, 120, 150 agents a world")
      ->check(CLI::IsMember({"light", "medium", "dense"}))
      ->capture_default_str();
  command->add_option("--agents", options.agents_per_world, "Agents a world, instead of the densities' own numbers")
      ->check(CLI::Range(1, kMaxAgentsPerWorld));
  command->add_option("--scenarios", options.scenarios, "Scenarios per density")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--steps", options.steps, "Steps of 0.1 s per scenario")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--sampled", arguments->sampled, "Draw actions from the policy instead of taking the most likely");
  command->add_option("--seed", options.seed, "Scenarios are drawn from it")->capture_default_str();
  add_policy_backend_options(command, "auto, and drawn as in training", &arguments->backends);
  CLI::Option* const rig = command->add_option(
      "--rig", options.rig, "A rig file with as many cameras as in training, instead of those of training");
  command->add_option("--size", arguments->size, "Pixels of an image, WxH, of the paper's rig; default: as in training")
      ->excludes(rig);
  command->add_option("--threads", options.num_threads, "Host threads; 0: all")->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Example:\n  pictura evaluate runs/town01/checkpoint.ckpt --map Town01 --density light --scenarios 4 --steps "
      "600");
  command->callback([arguments] {
    EvaluateOptions& evaluation = arguments->evaluate;
    evaluation.argmax = !arguments->sampled;
    const BackendOptions& backends = arguments->backends;
    if (!backends.device.empty()) evaluation.device = backends.device;
    if (!backends.simulator.empty()) evaluation.simulator = backends.simulator;
    evaluation.renderer = backends.renderer;
    if (!arguments->size.empty()) {
      const Pair pixels = parse_pair("--size", arguments->size, 8192);
      evaluation.width_px = pixels.first;
      evaluation.height_px = pixels.second;
    }
    evaluation.samples = backends.samples;
    evaluation.densities.clear();
    for (const std::string& name : arguments->densities) evaluation.densities.push_back(kDensities.at(name));
    if (evaluation.agents_per_world > 0) evaluation.densities.resize(1);
    ProgressLine line;
    evaluation.on_progress = [&line](double done, double eta_s) {
      line.update(fmt::format("evaluating: {:.0f} %  ETA {}", 100 * done, format_duration(eta_s)));
    };
    const EvaluateReport report = evaluate(evaluation);
    line.finish();
    if (arguments->json)
      print_report(evaluation, report);
    else
      print_table(report.rows);
    if (report.interrupted) {
      throw Interrupted(fmt::format("interrupted; {} of {} densities are finished", report.rows.size(),
                                    evaluation.agents_per_world > 0 ? 1 : evaluation.densities.size()));
    }
  });
}

}  // namespace pictura
