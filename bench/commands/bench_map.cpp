// `pictura bench map`: measures the processor time to import a map, to load it from the cache, and to compile it for
// simulators and renderers, and the peak memory. The default map is a town as large as the largest town of CARLA.
#include <ctime>

#include <fmt/format.h>
#include <sys/resource.h>

#include "pictura/bench/commands/bench.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_cache.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

namespace {

// A town whose OpenDRIVE file has 23 MB.
constexpr const char* kLargeTown = "procedural:1:blocks=27x26";

struct MapArguments {
  std::string map = kLargeTown;
  int repeats = 5;
  bool json = false;
};

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double peak_memory_gib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1 << 20);
}

void run_map(const MapArguments& arguments) {
  const MapText text = map_text(arguments.map);
  const MapCacheKey key = map_cache_key(text.text, {});
  BenchResult import{"import", "s", {}}, cached{"from the cache", "s", {}}, compile{"compile", "s", {}};
  ProgressLine progress;
  double lane_km = 0;
  for (int i = 0; i < arguments.repeats; ++i) {
    progress.update(fmt::format("{}: repeat {} of {}", arguments.map, i + 1, arguments.repeats),
                    static_cast<double>(i) / arguments.repeats);
    throw_if_interrupted();
    double begin = processor_s();
    const auto measure = [&](BenchResult* result) {
      result->values.push_back(processor_s() - begin);
      begin = processor_s();
    };
    auto map = std::make_shared<const RoadMap>(parse_opendrive(text.text, text.source));
    measure(&import);
    lane_km = 0;
    for (const Lane& lane : map->lanes) lane_km += 1e-3 * lane.length_m;
    const std::string bytes = encode_map(*map, key);
    begin = processor_s();
    // Does the work of load_map(): computes the file's hash, then decodes the cached map.
    decode_map(bytes, map_cache_key(text.text, {}), "cache");
    measure(&cached);
    compile_map(std::move(map), {});
    measure(&compile);
  }
  progress.finish();
  report_benchmark(arguments.json,
                   {.workload = fmt::format("map: {}, {:.1f} MB of OpenDRIVE, {:.0f} km of lanes; processor time",
                                            arguments.map, 1e-6 * static_cast<double>(text.text.size()), lane_km),
                    .backend = "cpu"},
                   {import, cached, compile, {"peak memory", "GiB", {peak_memory_gib()}}});
}

}  // namespace

void add_map_benchmark(CLI::App& bench) {
  auto arguments = std::make_shared<MapArguments>();
  CLI::App* command = bench.add_subcommand("map", "Time to import, load and compile a large map");
  command->add_option("--map", arguments->map, "A .xodr file, a town's name, procedural[:SEED], or city[:SEED]")
      ->capture_default_str();
  add_number_option(command, "--repeats", arguments->repeats, "Measurements; the median is printed", 1, 1000);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "Examples:\n"
      "  pictura bench map\n"
      "  pictura bench map --map Town05 --repeats 3\n"
      "  pictura bench map --map procedural:2 --json");
  command->callback([arguments] { run_map(*arguments); });
}

}  // namespace pictura
