// `pictura bench quality`: measures the PSNR of images against the truth, a ray caster with 1,024 samples per pixel. It
// measures the CPU renderer, a z-buffer with one sample and with 2x2 samples, and exact coverage used as alpha, at the
// five image sizes of the Pictura paper.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pictura/bench/commands/bench.h"
#include "pictura/bench/quality.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/map/load_map.h"

namespace pictura {

namespace {

struct QualityArguments {
  std::vector<std::string> maps;
  std::vector<std::string> sizes = {"32x18", "64x36", "96x54", "192x108", "384x216"};
  SnapshotOptions world{.views = 2};
  float line_floor_px = RendererConfig{}.line_floor_px;
  std::string figure;
  int random = 0;
  bool json = false;
};

std::vector<Snapshot> drive_all(const QualityArguments& arguments, ProgressLine* progress) {
  std::vector<Snapshot> snapshots;
  for (const std::string& map : arguments.maps) {
    throw_if_interrupted();
    progress->update(fmt::format("driving on {}", map));
    SnapshotOptions world = arguments.world;
    world.map = map;
    snapshots.push_back(drive_snapshot(world));
  }
  return snapshots;
}

// Measures the PSNR of each random scene of each kind.
void run_random(const QualityArguments& arguments) {
  ProgressLine progress;
  std::vector<BenchResult> results;
  for (int kind = 0; kind < kNumRandomKinds; ++kind) {
    const char* name = kRandomKindNames[kind];
    std::vector<double> psnr_db(static_cast<std::size_t>(arguments.random));
    parallel_for(resolve_num_threads(arguments.world.num_threads), arguments.random, [&](int64_t i) {
      throw_if_interrupted();
      const auto seed = arguments.world.seed + static_cast<uint64_t>(i);
      // Replaces the infinite PSNR of empty images.
      constexpr double kMost_db = 99;
      psnr_db[i] = std::min(measure_random_scene(static_cast<RandomKind>(kind), seed).psnr_db(), kMost_db);
    });
    progress.update(name);
    const auto worst = std::min_element(psnr_db.begin(), psnr_db.end()) - psnr_db.begin();
    results.push_back(
        {fmt::format("{} (worst: seed {})", name, arguments.world.seed + static_cast<uint64_t>(worst)), "dB", psnr_db});
  }
  progress.finish();
  report_benchmark(
      arguments.json,
      {fmt::format("quality: PSNR of the oracle against 1,024 samples a pixel, {} random scenes of each kind",
                   arguments.random),
       "cpu"},
      results);
}

void run_quality(QualityArguments arguments) {
  if (arguments.random > 0) return run_random(arguments);
  if (arguments.maps.empty()) {
    arguments.maps = known_towns();
    arguments.maps.insert(arguments.maps.end(), {"procedural:1", "procedural:2"});
  }
  arguments.maps = named_maps(arguments.maps);
  std::vector<Pair> sizes;
  for (const std::string& size : arguments.sizes) sizes.push_back(parse_pair("--size", size, 8192));
  ProgressLine progress;
  const std::vector<Snapshot> snapshots = drive_all(arguments, &progress);
  std::vector<BenchResult> results;
  int images = 0;
  for (const Pair& size : sizes) {
    const std::string text = fmt::format("{}x{}", size.first, size.second);
    RendererConfig config{.rig = paper_rig(size.first, size.second), .num_threads = arguments.world.num_threads};
    config.line_floor_px = arguments.line_floor_px;
    Quality quality;
    for (std::size_t i = 0; i < snapshots.size(); ++i) {
      throw_if_interrupted();
      progress.update(fmt::format("{} on {}", text, arguments.maps[i]));
      quality.add(measure_quality(snapshots[i].geometry, snapshots[i].scene.batch(), snapshots[i].views, config));
    }
    images += quality.images;
    auto add = [&](const std::string& method, double psnr_db) {
      results.push_back({fmt::format("{} {}", method, text), "dB", {psnr_db}});
    };
    add("1 sample", quality.one_sample.psnr_db());
    add("2x2 samples", quality.grid_2x2.psnr_db());
    add("area coverage", quality.area.psnr_db());
    add("oracle", quality.oracle.psnr_db());
    add("oracle in bytes", quality.oracle_bytes.psnr_db());
    add("oracle, worst image", quality.worst_image_db);
  }
  progress.finish();
  if (!arguments.figure.empty()) {
    RendererConfig config{.rig = paper_rig()};
    config.line_floor_px = arguments.line_floor_px;
    write_quality_figure(arguments.figure, snapshots, config);
  }
  report_benchmark(
      arguments.json,
      {fmt::format(
           "quality: PSNR against 1,024 samples a pixel, {} images that are not blank, maps {}, {} agents, walls {}, "
           "{} views x 4 cameras each, line floor {} px",
           images, fmt::join(arguments.maps, " "), arguments.world.agents, arguments.world.walls ? "on" : "off",
           arguments.world.views, arguments.line_floor_px),
       "cpu"},
      results);
}

}  // namespace

void add_quality_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<QualityArguments>();
  CLI::App* command = bench.add_subcommand("quality", "PSNR of images against a ray caster");
  add_maps_option(command, &arguments->maps, "all towns of the map folder and two procedural towns");
  command->add_option("--size", arguments->sizes, "Sizes, WxH; default: the paper's five")->delimiter(',');
  add_number_option(command, "--agents", arguments->world.agents, "Agents in each world", 1, kMaxAgentsPerWorld);
  add_number_option(command, "--views", arguments->world.views, "Agents whose cameras are drawn, in each world", 1);
  add_number_option(command, "--steps", arguments->world.steps, "Steps of random actions before the images", 0);
  add_seed_option(command, &arguments->world.seed, "Seed of the worlds");
  add_threads_option(command, &arguments->world.num_threads);
  command->add_flag("!--no-walls", arguments->world.walls, "Leave out the walls along the building lines");
  add_number_option(command, "--line-floor", arguments->line_floor_px, "Minimum width of a line on screen in pixels", 0,
                    kMaxLineFloor_px);
  add_number_option(
      command, "--random", arguments->random,
      "Measure this many random scenes of each kind (bench/truth/random_scenes.h) instead, from --seed on", 1);
  command->add_option("--figure", arguments->figure, "Write crops of all methods to this PNG file")
      ->check(output_file({".png"}));
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Examples:\n  pictura bench quality --map Town03 --size 96x54 --views 10 --figure quality.png\n"
      "  pictura bench quality --map procedural:1 --views 4 --json\n"
      "  pictura bench quality --random 20 --seed 5");
  command->callback([arguments] { run_quality(*arguments); });
}

}  // namespace pictura
