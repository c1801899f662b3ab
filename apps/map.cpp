// `pictura map`: the facts of a map, and its picture from above.
#include <chrono>

#include "pictura/apps/commands.h"
#include "pictura/apps/drawing.h"
#include "pictura/apps/report.h"
#include "pictura/common/error.h"
#include "pictura/map/load_map.h"

namespace pictura {

void add_map_command(CLI::App& app) {
  struct Arguments {
    std::string map, png;
    int size_px = 1600;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("map", "Print a map's facts and draw it from above");
  command->add_option("MAP", arguments->map, "A .xodr file, a town's name, or procedural[:SEED]")->required();
  command->add_option("--png", arguments->png, "Draw lanes, markings, edges, lights and crosswalks into this file");
  command->add_option("--size", arguments->size_px, "Longer side of the picture in pixels")
      ->check(CLI::Range(64, 16384))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer("Examples:\n  pictura map Town01 --json\n  pictura map procedural:7 --png town.png");
  command->callback([arguments] {
    LoadReport report;
    const auto begin = std::chrono::steady_clock::now();
    const std::shared_ptr<const RoadMap> map = load_map(arguments->map, {}, &report);
    const double load_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    if (!arguments->png.empty()) draw_map_png(*map, arguments->png, arguments->size_px);
    const MapFacts& facts = map->facts;
    const Json object{{"map", map->name},
                      {"roads", facts.roads},
                      {"junction_roads", facts.junction_roads},
                      {"junctions", facts.junctions},
                      {"signal_junctions", facts.signal_junctions},
                      {"lanes", facts.lanes},
                      {"driving_lanes", facts.driving_lanes},
                      {"driving_lane_km", facts.driving_lane_km},
                      {"traffic_lights", facts.traffic_lights},
                      {"stop_lines", facts.stop_lines},
                      {"crosswalks", facts.crosswalks},
                      {"parking_spaces", facts.parking_spaces},
                      {"z_min_m", facts.z_min_m},
                      {"z_max_m", facts.z_max_m},
                      {"cached", report.cached},
                      {"load_ms", load_ms}};
    if (arguments->json) return print_json(object);
    for (const auto& [key, value] : object.items()) {
      fmt::print("{:18} {}\n", key,
                 value.is_string()         ? value.get<std::string>()
                 : value.is_number_float() ? fmt::format("{:.2f}", value.get<double>())
                                           : value.dump());
    }
    if (!arguments->png.empty()) fmt::print("drawn into {}\n", arguments->png);
  });
}

}  // namespace pictura
