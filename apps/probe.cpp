// `pictura probe`: what policies make of what their cameras see, and of what they do not.
#include <algorithm>

#include "pictura/apps/commands.h"
#include "pictura/apps/removal_figure.h"
#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/support/file.h"
#include "pictura/training/probes/removal.h"

namespace pictura {

namespace {

void print_table(const RemovalResults& results, const std::vector<RemovalRow>& rows) {
  size_t width = 6;
  for (const ProbedPolicy& policy : results.policies) width = std::max(width, policy.name.size());
  fmt::print("{:{}} {:>10} {:>8} {:>7} {:>20} {:>20} {:>8}\n", "policy", width, "occlusion", "cases", "scenes", "|dV|",
             "|dP(brake)|", "changed");
  const auto text = [](const Estimate& e) { return fmt::format("{:.4f} +- {:.4f}", e.value, e.half_width_95); };
  for (const RemovalRow& row : rows) {
    if (row.group.distance_band || row.cases == 0) continue;
    fmt::print("{:{}} {:>10} {:>8} {:>7} {:>20} {:>20} {:>6.1f} %\n",
               results.policies[static_cast<size_t>(row.policy)].name, width, row.group.occlusion_name(), row.cases,
               row.scenes, text(row.abs_value_change), text(row.abs_brake_change), 100 * row.changed_share.value);
  }
  fmt::print(
      "means over scenes of the means of their cases; +- is the half width of a 95 % confidence interval over "
      "scenes\n");
  fmt::print("{} removals in {}\n", results.cases.size(), format_duration(results.seconds));
}

void add_removal_command(CLI::App& probe) {
  struct Arguments {
    EvaluationArguments evaluation;
    RemovalOptions removal;
    std::string density = "medium", control = kRemovalControlNames[0], out = "probe_removal";
    int scenes = 0;  // 0: not given
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  RemovalOptions& options = arguments->removal;
  EvaluateOptions& worlds = arguments->evaluation.evaluate;
  worlds.steps = kProbeSteps;
  CLI::App* command = probe.add_subcommand(
      "removal", "How value and braking change when one road user is taken away, by how occluded it is");
  command
      ->add_option("POLICY", options.policies, "Checkpoints that train wrote, or safetensors; the world is the first's")
      ->required();
  add_evaluation_options(command, &arguments->evaluation);
  command->add_option("--density", arguments->density, "light, medium or dense: 60, 120 or 150 agents a world")
      ->check(one_of({kDensityNames.begin(), kDensityNames.end()}))
      ->capture_default_str();
  command
      ->add_option("--scenes", arguments->scenes,
                   "Scenarios that are driven, an equal share by each policy; default: as many on each map for each "
                   "policy, two a map or more")
      ->transform(whole_number(1));
  command->add_option("--first-scene", worlds.first_scenario, "The number of the first scenario")
      ->transform(whole_number(0))
      ->capture_default_str();
  command->add_option("--removals", options.removals, "Cases in all: one user hidden for one ego in one state")
      ->transform(whole_number(1))
      ->capture_default_str();
  command->add_option("--every", options.sample_steps, "Steps between sampled states")
      ->transform(whole_number(1))
      ->capture_default_str();
  command->add_option("--range", options.range_m, "How far away a user may be, m")
      ->transform(number(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--control", arguments->control,
                   "A control: nobody hides no one; permuted hides another of the ego's users, drawn anew for each "
                   "case")
      ->check(one_of({kRemovalControlNames.begin(), kRemovalControlNames.end()}))
      ->capture_default_str();
  command
      ->add_option("--batch", options.batch,
                   "Cases in a call, rounded up to whole passes of a network; changes memory and time alone")
      ->transform(whole_number(1, 1 << 20))
      ->capture_default_str();
  command->add_option("--out", arguments->out, "The folder for cases.csv, summary.json and removal.png")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object, that of summary.json");
  command->footer(
      "docs/probes.md says what is asked, how, and what the files hold.\n"
      "Examples:\n"
      "  pictura probe removal agent.safetensors vector.safetensors --out removal\n"
      "  pictura probe removal runs/a/checkpoint.ckpt --map Town01 --scenes 2 --removals 2000 --steps 300\n"
      "  pictura probe removal agent.safetensors --map procedural:1 --agents 40 --removals 1000 --control nobody");
  command->callback([arguments] {
    settle_evaluation_options(&arguments->evaluation);
    RemovalOptions& removal = arguments->removal;
    removal.worlds = arguments->evaluation.evaluate;
    EvaluateOptions& driven = removal.worlds;
    driven.densities = {density_named(arguments->density)};
    driven.scenarios =
        arguments->scenes > 0 ? arguments->scenes : default_probe_scenes(removal.policies.size(), driven.maps.size());
    removal.control = removal_control_named(arguments->control);
    make_output_folder(arguments->out);
    ProgressLine line;
    driven.on_progress = [&line](double done, double eta_s) {
      line.update(fmt::format("probing: {:.0f} %  ETA {}", 100 * done, format_duration(eta_s)));
    };
    const RemovalResults results = probe_removal(removal);
    line.finish();
    const std::vector<RemovalRow> rows = summarize(results);
    const std::string folder = arguments->out + "/", cases_file = folder + "cases.csv";
    const std::string summary = removal_summary_json(results, rows, cases_file);
    write_removal_cases(cases_file, results);
    write_file(folder + "summary.json", summary + "\n");
    draw_removal_figure(results, rows, folder + "removal.png");
    if (arguments->json)
      print_json(Json::parse(summary));
    else
      print_table(results, rows);
    if (results.interrupted) {
      throw Interrupted(fmt::format("interrupted; {} of {} removals are done, and written to {}", results.cases.size(),
                                    results.removals_asked, arguments->out));
    }
  });
}

}  // namespace

void add_probe_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("probe", "Ask policies what they see: probe removal");
  command->require_subcommand(1);
  command->footer(
      "Examples:\n  pictura probe removal agent.safetensors vector.safetensors --out removal\n"
      "  pictura probe removal runs/a/checkpoint.ckpt --map Town01 --scenes 2 --removals 2000 --steps 300\n"
      "  pictura probe removal agent.safetensors --map procedural:1 --agents 40 --removals 1000 --control nobody");
  add_removal_command(*command);
}

}  // namespace pictura
