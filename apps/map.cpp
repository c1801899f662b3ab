// `pictura map`: prints a map's properties, lists its elements, and draws it from above.
#include <algorithm>

#include "pictura/apps/commands.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/map_listing.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/drawing/drawing.h"
#include "pictura/driving/reported_map.h"
#include "pictura/map/blind_approaches.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/map_geometry.h"
#include "pictura/map/map_statistics.h"
#include "pictura/map/open_lanes.h"
#include "pictura/map/opendrive/writer.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/load_scenario.h"

namespace pictura {

namespace {

constexpr double kQuiet_s = 0.3;  // imports show progress after this time

struct MapArguments {
  std::string map, png, svg, xodr;
  int size_px = 1600;
  std::vector<double> box, at;
  double radius_m = 50;
  bool json = false, full = false, strict = false;
};

std::optional<FileBox> shown_box(const MapArguments& arguments) {
  if (!arguments.box.empty()) return FileBox{arguments.box[0], arguments.box[1], arguments.box[2], arguments.box[3]};
  if (arguments.at.empty()) return std::nullopt;
  const double x = arguments.at[0], y = arguments.at[1], radius = arguments.radius_m;
  return FileBox{x - radius, y - radius, x + radius, y + radius};
}

Json facts_of(const RoadMap& map) {
  Json object{{"map", map.name}, {"origin_m", map.origin_m}};
  visit_fields(map.facts, [&object](const std::string& name, const auto& value) { object[name] = value; });
  return object;
}

Json statistics_of(const RoadMap& map) {
  Json object;
  visit_fields(map_statistics(map), [&object](const std::string& name, const auto& value) { object[name] = value; });
  return object;
}

void add_lane_use(const RoadMap& map, Json* object_out) {
  const LaneUse use = count_lane_use(map);
  (*object_out)["endless_lanes"] = use.endless;
  (*object_out)["open_lanes"] = use.open;
  (*object_out)["unreachable_lanes"] = use.unreachable;
}

/// Adds the counts of blind approaches (blind_approaches.h) with the default walls of simulations.
void add_blind_approaches(const RoadMap& map, Json* object_out) {
  const std::vector<WallFace> walls = make_walls(map, {});
  const BlindApproaches count = count_blind_approaches(map, walls);
  (*object_out)["walls"] = walls.size();
  (*object_out)["approaches"] = count.approaches;
  (*object_out)["blind_approaches"] = count.blind;
}

void add_scene_facts(const Scenario& scenario, Json* object_out) {
  Json& object = *object_out;
  const ScenarioFacts facts = pictura::facts_of(scenario);
  const LoggedDriving driving = logged_driving(scenario);
  object["scenario_id"] = scenario.id;
  object["format"] = scenario.format;
  object["steps"] = scenario.num_steps;
  object["dt_s"] = scenario.dt_s;
  object["current_step"] = scenario.current_step;
  object["tracks"] = scenario.tracks.size();
  object["vehicles"] = facts.vehicles;
  object["moving_vehicles"] = facts.moving_vehicles;
  object["pedestrians"] = facts.pedestrians;
  object["cyclists"] = facts.cyclists;
  object["others"] = facts.others;
  object["tracks_with_gaps"] = facts.tracks_with_gaps;
  object["sdc_track"] = scenario.sdc_track >= 0 ? Json(scenario.sdc_track) : Json(nullptr);
  object["tracks_to_predict"] = scenario.tracks_to_predict.size();
  object["objects_of_interest"] = scenario.objects_of_interest.size();
  object["recorded_lights"] = scenario.lights.size();
  object["recorded_light_states"] = facts.recorded_light_states;
  object["moving_vehicle_steps"] = driving.vehicle_steps;
  object["steps_touching_edge"] = driving.touching;
  object["steps_off_road"] = driving.off_road;
  Json notes = Json::array();
  for (const ConversionNote& note : scenario.notes) {
    notes.push_back({{"what", note.what}, {"count", note.count}, {"first", note.first}});
  }
  object["notes"] = notes;
}

void print_table(const Json& object) {
  for (const auto& [key, value] : object.items()) {
    print_result("{:28} {}\n", key,
                 value.is_string()         ? value.get<std::string>()
                 : value.is_number_float() ? fmt::format("{:.2f}", value.get<double>())
                                           : value.dump());
  }
}

/// Returns the repairs by kind: the fault, the action, the number of repairs, and all messages.
Json repairs_of(const RoadMap& map, const std::string& source) {
  Json groups = Json::array();
  for (const RepairGroup& group : group_repairs(map.mends)) {
    Json faults = Json::array();
    for (const Repair* repair : group.repairs) faults.push_back(message_of(*repair, source));
    groups.push_back({{"fault", to_string(group.kind)},
                      {"done", action_of(group.kind)},
                      {"count", group.repairs.size()},
                      {"faults", std::move(faults)}});
  }
  return groups;
}

/// Reports on a recorded scene: facts about its map, its tracks and its lights, and the agreement of its traffic with
/// the road edges.
void run_scene(const MapArguments& arguments) {
  if (!arguments.xodr.empty()) fail_usage("--xodr: {} is a recorded scene, which has no OpenDRIVE", arguments.map);
  SceneReport report;
  const Stopwatch watch;
  const Scenario scenario = load_scenario(arguments.map, &report);
  const double load_ms = 1e3 * watch.seconds();
  throw_if_interrupted();
  const MapPictureOptions picture{.size_px = arguments.size_px, .box = shown_box(arguments), .scenario = &scenario};
  if (!arguments.png.empty()) draw_map_png(scenario.map, arguments.png, picture);
  if (!arguments.svg.empty()) draw_map_svg(scenario.map, arguments.svg, picture);
  Json object = facts_of(scenario.map);
  add_scene_facts(scenario, &object);
  object["cached"] = report.cached;
  if (!report.cache_rejection.empty()) object["cache_refused"] = report.cache_rejection;
  object["load_ms"] = load_ms;
  if (arguments.full) return print_listing(object, scenario.map);
  if (arguments.json) return print_json(object);
  for (const ConversionNote& note : scenario.notes) {
    print_message("note: {} {} (first: {})\n", note.count, note.what, note.first);
  }
  object.erase("notes");
  print_table(object);
  for (const std::string& path : {arguments.png, arguments.svg}) {
    if (!path.empty()) print_result("drawn into {}\n", path);
  }
}

void run_map(const CLI::App& command, const MapArguments& arguments) {
  if (arguments.png.empty() && arguments.svg.empty()) {
    for (const char* option : {"--at", "--box", "--size"}) {
      if (command.count(option) > 0) fail_usage("{}: has no effect without --png or --svg", option);
    }
  }
  if (command.count("--lenient") > 0) {
    fail_usage(
        "--lenient: was removed: faults with a single sensible meaning are repaired by default; --strict rejects them");
  }
  if (arguments.full && !arguments.json) fail_usage("--full: lists elements as JSON; expected --json with it");
  if (is_scene_name(arguments.map)) return run_scene(arguments);
  LoadReport report;
  ProgressLine progress;
  const Stopwatch watch;
  const std::shared_ptr<const RoadMap> map =
      load_map(arguments.map, {.strict = arguments.strict}, &report, [&](const char* stage, double done) {
        throw_if_interrupted();
        if (watch.seconds() > kQuiet_s) progress.update(fmt::format("{}: {}", arguments.map, stage), done);
      });
  progress.finish();
  const double load_ms = 1e3 * watch.seconds();
  throw_if_interrupted();
  print_repairs(*map, report.source);
  const MapPictureOptions picture{.size_px = arguments.size_px, .box = shown_box(arguments)};
  if (!arguments.png.empty()) draw_map_png(*map, arguments.png, picture);
  throw_if_interrupted();
  if (!arguments.svg.empty()) draw_map_svg(*map, arguments.svg, picture);
  if (!arguments.xodr.empty()) {
    const MapText text = map_text(arguments.map);
    write_file(arguments.xodr, export_opendrive(text.text, text.source));
  }
  Json object = facts_of(*map);
  add_lane_use(*map, &object);
  add_blind_approaches(*map, &object);
  object["cached"] = report.cached;
  if (!report.cache_rejection.empty()) object["cache_refused"] = report.cache_rejection;
  object["load_ms"] = load_ms;
  object["mends"] = repairs_of(*map, report.source);
  object["statistics"] = statistics_of(*map);
  if (arguments.full) return print_listing(object, *map);
  if (arguments.json) return print_json(object);
  object.erase("mends");  // reported on stderr
  object.erase("statistics");
  print_table(object);
  for (const std::string& path : {arguments.png, arguments.svg}) {
    if (!path.empty()) print_result("drawn into {}\n", path);
  }
  if (!arguments.xodr.empty()) print_result("written to {}\n", arguments.xodr);
}

}  // namespace

void add_map_command(CLI::App& app) {
  constexpr double kFarthest_m = 1e8;  // maximum distance from the origin of a map projection
  auto arguments = std::make_shared<MapArguments>();
  CLI::App* command = app.add_subcommand("map", "Print a map's properties, list its elements, draw it from above");
  add_map_or_scene(command, &arguments->map);
  command
      ->add_option("--png", arguments->png,
                   "Draw lanes, markings, edges, lights, signs, crosswalks, parking and building lines into this file")
      ->check(output_file({".png"}));
  command->add_option("--svg", arguments->svg, "Draw the same picture as vector graphics")
      ->check(output_file({".svg"}));
  add_number_option(command, "--size", arguments->size_px, "Longer side of the picture in pixels", 64, 16384);
  CLI::Option* box =
      command
          ->add_option("--box", arguments->box,
                       "Draw only the rectangle between two corners, in metres of the file's coordinates")
          ->expected(4)
          ->transform(number(-kFarthest_m, kFarthest_m))
          ->type_name("X0 Y0 X1 Y1");
  CLI::Option* at = command
                        ->add_option("--at", arguments->at,
                                     "Draw the surroundings of this point, in metres of the file's coordinates")
                        ->expected(2)
                        ->transform(number(-kFarthest_m, kFarthest_m))
                        ->type_name("X Y")
                        ->excludes(box);
  add_number_option(command, "--radius", arguments->radius_m, "Radius around --at, in metres", 0.5, kFarthest_m)
      ->needs(at);
  command
      ->add_option("--xodr", arguments->xodr,
                   "Write the map as OpenDRIVE, with only those elements that the importer uses")
      ->check(output_file({".xodr"}));
  command->add_flag("--strict", arguments->strict,
                    "Reject every fault of the file, including faults that are repaired by default");
  command->add_flag("--lenient")->group("");  // option of earlier versions; it is rejected with a hint
  command->add_flag("--json", arguments->json, "Print one JSON object; its key 'mends' lists every repaired fault");
  command->add_flag("--full", arguments->full, "With --json: list every element with its position in the file");
  command->footer(
      "Examples:\n  pictura map Town01 --json\n  pictura map procedural:7 --png town.png\n"
      "  pictura map city:7 --png city.png\n"
      "  pictura map Town03 --svg crossing.svg --at 0 0 --radius 40\n"
      "  pictura map validation.tfrecord-00000-of-00150#7 --png scene.png");
  command->callback([arguments, command] { run_map(*command, *arguments); });
}

}  // namespace pictura
