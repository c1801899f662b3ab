#include "pictura/map/lanelet2/lanelet2.h"

#include <filesystem>

#include "pictura/map/endless_lanes.h"
#include "pictura/map/import.h"
#include "pictura/map/lanelet2/build.h"

namespace pictura {

namespace {

RoadMap import_file(std::string_view text, const std::string& source, const OpenDriveOptions& options,
                    const std::optional<GeoPoint>& origin, const ImportProgress& progress) {
  const InterruptibleWork work(fmt::format("{}: interrupted while it was imported", source));
  const auto begin = [&](const char* stage, double done) {
    work.check();
    if (progress) progress(stage, done);
  };
  begin("reading", 0);
  opendrive::Faults faults(options.strict);
  lanelet2::OsmFile file;
  lanelet2::read_osm(text, source, &faults, &file);
  lanelet2::place_nodes(origin, options.plan, &faults, &file);
  RoadMap map;
  map.name = std::filesystem::path(source).stem().string();
  map.geo_reference = file.geo_reference;
  lanelet2::Build build{file, options, &faults, &map, import_budget(text.size(), source, work)};
  begin("lanes", 0.2);
  lanelet2::find_lanelets(&build);
  lanelet2::build_lanes(&build);
  find_endless_lanes(&map);
  begin("road edges", 0.4);
  lanelet2::build_areas(&build);
  lanelet2::build_edges(&build);
  begin("markings", 0.8);
  lanelet2::build_paint(&build);
  lanelet2::build_rules(&build);
  lanelet2::count_facts(&build);
  map.mends = faults.take();
  validate(map);
  return map;
}

}  // namespace

RoadMap parse_lanelet2(std::string_view text, const std::string& source, const OpenDriveOptions& options,
                       const std::optional<GeoPoint>& origin, const ImportProgress& progress) {
  check_import_options(options);
  return import_named(source, [&] { return import_file(text, source, options, origin, progress); });
}

}  // namespace pictura
