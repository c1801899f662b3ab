#include "pictura/map/opendrive/opendrive.h"

#include <filesystem>

#include "pictura/common/file.h"
#include "pictura/map/opendrive/build.h"
#include "pictura/map/opendrive/reader.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura {

namespace {

constexpr std::size_t kMaxFile_bytes = std::size_t{1} << 29;

}  // namespace

RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options,
                        std::vector<std::string>* warnings_out) {
  PICTURA_CHECK(options.chord_error_m >= 1e-3f && options.chord_error_m <= 10.0f,
                "OpenDRIVE options: expected a chord error in [0.001, 10] m, got {}", options.chord_error_m);
  opendrive::Faults faults(options.lenient);
  opendrive::Network network;
  opendrive::read_network(text, source, &faults, &network);
  opendrive::split_at_speed_changes(&network);

  RoadMap map;
  map.name = std::filesystem::path(source).stem().string();
  map.geo_reference = network.geo_reference;
  opendrive::Build build{network, options, &faults, &map};
  opendrive::choose_origin(&build);
  opendrive::build_lanes(&build);
  opendrive::link_lanes(&build);
  opendrive::set_speed_limits(&build);
  opendrive::find_endless_lanes(&build);
  opendrive::build_road_edges(&build);
  opendrive::build_markings(&build);
  opendrive::build_objects(&build);
  opendrive::build_signals(&build);
  opendrive::build_building_lines(&build);
  opendrive::count_facts(&build);
  validate(map);
  if (warnings_out) *warnings_out = faults.take_warnings();
  return map;
}

RoadMap load_opendrive(const std::string& path, const OpenDriveOptions& options,
                       std::vector<std::string>* warnings_out) {
  return parse_opendrive(read_file(path, kMaxFile_bytes), path, options, warnings_out);
}

}  // namespace pictura
