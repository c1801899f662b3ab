#include "pictura/map/lanelet2/lanelet2.h"

#include "pictura/map/endless_lanes.h"
#include "pictura/map/import.h"
#include "pictura/map/lanelet2/build.h"

namespace pictura {

namespace {

void import_file(std::string_view text, const std::string& source, const std::optional<GeoPoint>& origin,
                 MapImport* import) {
  import->begin("reading", 0);
  lanelet2::OsmFile file;
  lanelet2::read_osm(text, source, &import->faults, &file);
  lanelet2::place_nodes(origin, import->options.plan, &import->faults, &file);
  RoadMap& map = import->map;
  map.geo_reference = file.geo_reference;
  lanelet2::Build build{file, import->options, &import->faults, &map, import->budget()};
  import->begin("lanes", 0.2);
  lanelet2::find_lanelets(&build);
  lanelet2::build_lanes(&build);
  find_endless_lanes(&map);
  import->begin("road edges", 0.4);
  lanelet2::build_areas(&build);
  lanelet2::build_edges(&build);
  import->begin("markings", 0.8);
  lanelet2::build_paint(&build);
  lanelet2::build_rules(&build);
  lanelet2::count_facts(&build);
}

}  // namespace

RoadMap parse_lanelet2(std::string_view text, const std::string& source, const OpenDriveOptions& options,
                       const std::optional<GeoPoint>& origin, const ImportProgress& progress) {
  return import_map(text.size(), source, options, progress,
                    [&](MapImport* import) { import_file(text, source, origin, import); });
}

}  // namespace pictura
