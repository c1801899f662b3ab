#include "pictura/map/opendrive/opendrive.h"

#include "pictura/map/import.h"
#include "pictura/map/open_lanes.h"
#include "pictura/map/opendrive/build.h"
#include "pictura/map/opendrive/deform.h"
#include "pictura/map/opendrive/lights.h"
#include "pictura/map/opendrive/reader.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura {

namespace {

void import_network(std::string_view text, const std::string& source, MapImport* import) {
  // The shares of the work were measured on large networks.
  import->begin("reading", 0);
  opendrive::Network network;
  opendrive::read_network(text, source, &import->faults, &network);
  opendrive::split_at_speed_changes(&network);
  opendrive::split_at_lights(&network);

  const OpenDriveOptions& options = import->options;
  RoadMap& map = import->map;
  if (options.plan == PlanMap{}) {
    map.geo_reference = network.geo_reference;
  } else {
    opendrive::deform(options.plan, &network);  // a deformed copy has no place on Earth
  }
  opendrive::Build build{network, options, &import->faults, &map, import->budget(), {}, {}, {}};
  import->begin("lanes", 0.1);
  opendrive::choose_origin(&build);
  opendrive::build_lanes(&build);
  opendrive::link_lanes(&build);
  opendrive::set_speed_limits(&build);
  find_endless_lanes(&map);
  import->begin("road edges", 0.2);
  opendrive::build_road_edges(&build);
  if (!has_endless_roads(map)) opendrive::open_road_ends(&build);
  import->begin("markings", 0.8);
  opendrive::build_markings(&build);
  opendrive::build_objects(&build);
  opendrive::build_signals(&build);
  import->begin("building lines", 0.85);
  opendrive::build_building_lines(&build);
  opendrive::count_facts(&build);
}

}  // namespace

RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options,
                        const ImportProgress& progress) {
  return import_map(text.size(), source, options, progress,
                    [&](MapImport* import) { import_network(text, source, import); });
}

}  // namespace pictura
