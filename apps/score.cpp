// `pictura score`: computes the realism of a file's rollouts by comparison with the recorded scenes in which they
// begin.
#include "pictura/apps/commands.h"
#include "pictura/apps/realism_table.h"
#include "pictura/cli/interval_text.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"

namespace pictura {

void print_realism(const RealismReport& report) {
  print_warnings("left out", report.faults);
  std::vector<std::string> unused;
  for (const std::string& id : report.unused) unused.push_back(fmt::format("scenario '{}'", id));
  print_warnings("rollouts without a scene", unused);
  int64_t road_users = 0;
  std::vector<std::string> other_counts;
  for (const SceneRealism& scene : report.scenes) {
    road_users += scene.scored;
    if (scene.rollouts == kChallengeRollouts) continue;
    other_counts.push_back(fmt::format("scenario '{}': expected {} rollouts, got {}", scene.scenario_id,
                                       kChallengeRollouts, scene.rollouts));
  }
  print_warnings("scores of another number of rollouts are not comparable", other_counts);
  const RealismVersion& version = realism_version(report.version);
  print_result("realism {}: {} scenes, {} road users scored, {} scenes without rollouts\n\n", report.version,
               report.scenes.size(), road_users, report.without_rollouts);
  print_result("{:28} {:>6} {:>17}\n", "likelihood of the recorded", "weight", "");
  for (const RealismGroup& group : realism_groups()) {
    double weight = 0;
    for (const RealismFeature feature : group.features) weight += version.terms[static_cast<size_t>(feature)].weight;
    print_result("{:28} {:>6.2f} {:>17}\n", group.name, weight, interval_text(mean_of(report, group)));
    for (const RealismFeature feature : group.features) {
      print_result("  {:26} {:>6.2f} {:>17}\n", to_string(feature), version.terms[static_cast<size_t>(feature)].weight,
                   interval_text(mean_of(report, feature)));
    }
  }
  const auto mean = [&report](double SceneRealism::* member) { return interval_text(mean_of(report, member)); };
  print_result("{:28} {:>6.2f} {:>17}\n", "realism", 1.0, mean(&SceneRealism::score));
  print_result("{:28} {:>6} {:>17}\n\n", "  by road user", "", mean(&SceneRealism::score_by_object));
  const auto line = [&mean](const char* what, double SceneRealism::* member,
                            double SceneRealism::* recorded = nullptr) {
    print_result("{:34} {:>17} {:>17}\n", what, mean(member), recorded ? mean(recorded) : "");
  };
  print_result("{:34} {:>17} {:>17}\n", "", "rollouts", "recorded");
  line("ADE m", &SceneRealism::ade_m);
  line("minADE m", &SceneRealism::min_ade_m);
  line("collide", &SceneRealism::collision_rate, &SceneRealism::recorded_collision_rate);
  line("leave the road", &SceneRealism::off_road_rate, &SceneRealism::recorded_off_road_rate);
  line("run a red light", &SceneRealism::red_light_rate, &SceneRealism::recorded_red_light_rate);
  line("time to collision below 0.95 s", &SceneRealism::short_time_to_collision,
       &SceneRealism::recorded_short_time_to_collision);
  line("comfortable", &SceneRealism::comfort, &SceneRealism::recorded_comfort);
  line("progress on the recorded path", &SceneRealism::progress);
  print_result("+- is the half width of a 95 % confidence interval over scenes\n");
}

void add_score_command(CLI::App& app) {
  struct Arguments {
    std::string rollouts;
    std::vector<std::string> scenes;
    std::string version = "2025";
    int num_threads = 0;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("score", "Score how realistic rollouts of recorded scenes are");
  command
      ->add_option("ROLLOUTS", arguments->rollouts,
                   "Output of evaluate --rollouts, or a submission to the Waymo sim-agents challenge")
      ->required()
      ->check(CLI::ExistingFile);
  command
      ->add_option("--scenes", arguments->scenes,
                   "Scenes of the protocol: files, folders of files, FILE#K or FILE#SCENARIO_ID, separated by commas")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--realism", arguments->version, "Year of the challenge whose weights are used")
      ->check(CLI::IsMember(realism_version_names()).description("{2024,2025}"))
      ->capture_default_str();
  add_threads_option(command, &arguments->num_threads);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "docs/explanation/realism.md defines the numbers. Scenes without rollouts in the file are counted and left out.\n"
      "Examples:\n"
      "  pictura evaluate models/vector.safetensors --protocol simagents --scenes validation --sampled --rollouts "
      "r.binproto\n"
      "  pictura score r.binproto --scenes validation\n"
      "  pictura score theirs.binproto --scenes validation --realism 2024 --json");
  command->callback([arguments] {
    ProgressLine progress;
    const RealismReport report =
        score_rollouts(arguments->rollouts, arguments->scenes, realism_version(arguments->version),
                       arguments->num_threads, [&progress](double done) {
                         if (done < 1) progress.update(fmt::format("scoring: {:.0f} %", 100 * done), done);
                       });
    progress.finish();
    if (arguments->json)
      print_json(realism_json(report));
    else
      print_realism(report);
  });
}

}  // namespace pictura
