// `pictura replay`: records episodes as pages that a browser plays. Writes one page, or a folder of pages with an
// index.
#include "pictura/apps/commands.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/recording_options.h"
#include "pictura/cli/report.h"
#include "pictura/cli/world_options.h"
#include "pictura/common/error.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/driving/recording.h"
#include "pictura/driving/world.h"
#include "pictura/replay/gallery.h"
#include "pictura/simulator/drive_steps.h"

namespace pictura {

namespace {

struct ReplayArguments {
  WorldOptions world;
  int steps = 600, episodes = 10;
  RecordingOptions recording;
  std::string policy = "lane", out, gallery, mcap;
  bool json = false;
};

Json facts_of(const std::string& path, const Replay& replay) {
  Json metrics;
#define X(name) metrics[#name] = replay.metrics.name;
  PICTURA_REPLAY_METRICS(X)
#undef X
  return {{"file", path},
          {"map", replay.origin.map},
          {"seed", replay.origin.seed},
          {"agents", replay.num_agents},
          {"steps", replay.num_frames - 1},
          {"episodes", replay.episodes.size()},
          {"metrics", metrics}};
}

Replay record(ReplayArguments arguments, uint64_t seed, ProgressLine* line_out) {
  WorldOptions options = arguments.world;
  options.seed = seed;
  DrivenWorld world = make_world(options, arguments.policy);
  if (arguments.steps == 0) arguments.steps = world.simulator->config().episode_steps;
  check_replay_room(world.simulator->num_slots(), arguments.steps);
  resolve_followed(world, &arguments.recording);
  Recording recording(*world.simulator, {arguments.policy, world.session.get(), world.renderer.get()},
                      arguments.recording);
  const auto on_step = [&](int step, const StepResult&) {
    line_out->update(fmt::format("seed {}: step {}/{}", seed, step + 1, arguments.steps));
  };
  const DriveEnd end = drive_steps(*world.simulator, *world.controller, arguments.steps, {&recording}, on_step);
  if (end.is_interrupted) throw Interrupted(fmt::format("interrupted at step {} of {}", end.steps, arguments.steps));
  return recording.finish();
}

void run_replay(const ReplayArguments& arguments) {
  ProgressLine line;
  if (arguments.gallery.empty()) {
    const Replay replay = record(arguments, arguments.world.seed, &line);
    line.finish();
    if (arguments.json) print_json(facts_of(arguments.out.empty() ? arguments.mcap : arguments.out, replay));
    return write_replay_files(replay, arguments.out, arguments.mcap);
  }
  const OutputFolder folder(arguments.gallery);
  check_gallery(arguments.gallery);
  std::optional<FilledFolder> pages;  // with the first page
  Json replays = Json::array();
  try {
    for (int episode = 0; episode < arguments.episodes; ++episode) {
      const uint64_t seed = arguments.world.seed + static_cast<uint64_t>(episode);
      const Replay replay = record(arguments, seed, &line);
      line.finish();
      if (!pages) pages.emplace(arguments.gallery, "gallery");
      const std::string path = pages->file(fmt::format("seed_{}.html", seed));
      write_replay_with_message(path, replay);
      replays.push_back(facts_of(path, replay));
    }
  } catch (const Interrupted&) {
    if (!replays.empty()) write_index(&*pages);  // lists the completed replays
    throw;
  }
  write_index(&*pages);
  if (arguments.json) print_json({{"gallery", arguments.gallery}, {"replays", replays}});
}

}  // namespace

void add_replay_command(CLI::App& app) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand("replay", "Record a world as a page for browsers");
  add_driving_options(command, &arguments->world, &arguments->steps, &arguments->policy);
  add_recording_options(command, &arguments->recording);
  CLI::Option* const out = command->add_option("--out", arguments->out, "Page to write")->check(output_file({".html"}));
  CLI::Option* const gallery =
      command->add_option("--gallery", arguments->gallery,
                          "Instead of one page: folder for a page of each seed, and an index that lists the worst "
                          "replay first; replaces the pages of an earlier gallery");
  gallery->excludes(out);
  command->add_option("--mcap", arguments->mcap, "Also write an MCAP file, for Foxglove; with or without a page")
      ->check(output_file({".mcap"}))
      ->excludes(gallery);
  add_number_option(command, "--episodes", arguments->episodes, "Number of seeds, from --seed on, for --gallery", 1,
                    10000);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "The page is self-contained: any browser opens it from disk, without a network.\n"
      "Examples:\n  pictura replay Town01 --agents 120 --steps 1200 --out lane.html\n"
      "  pictura replay procedural:1 --policy runs/demo/checkpoint.ckpt --follow 3 --cameras --out demo.html\n"
      "  pictura replay Town01 --steps 300 --cameras --mcap drive.mcap\n"
      "  pictura replay Town05 --policy random --gallery replays --episodes 20");
  command->callback([arguments, command] {
    if (arguments->out.empty() && arguments->gallery.empty() && arguments->mcap.empty()) {
      fail_usage("replay: expected --out, --mcap or --gallery");
    }
    if (arguments->gallery.empty() && command->count("--episodes") > 0) {
      fail_usage("--episodes: has no effect without --gallery");
    }
    resolve_driving_options(*command, &arguments->world, &arguments->steps, &arguments->policy);
    reject_idle_backend_options(*command, arguments->policy);
    run_replay(*arguments);
  });
}

}  // namespace pictura
