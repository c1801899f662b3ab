#include "pictura/map/opendrive/reader.h"

#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/opendrive/document.h"
#include "pictura/map/opendrive/extent.h"
#include "pictura/map/opendrive/read_parts.h"
#include "pictura/map/opendrive/repair_links.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura::opendrive {

namespace {

constexpr double kMaxSpeed = 1000;  // maximum speed limit, in the unit of the file

/// The header's transform of all coordinates: a rotation about the origin, then a translation.
struct Offset {
  double x = 0, y = 0, z = 0, heading = 0;
};

Offset read_header(const Element& header, std::string* geo_reference_out) {
  if (!header) return {};
  if (const Element reference = header.child("geoReference")) *geo_reference_out = reference.content();
  const Element offset = header.child("offset");
  if (!offset) return {};
  return {offset.number_in("x", -1e8, 1e8), offset.number_in("y", -1e8, 1e8),
          offset.number_in("z", -kMaxHeight_m, kMaxHeight_m, 0), offset.number_in("hdg", -1e3, 1e3, 0)};
}

void apply(const Offset& offset, FileRoad* road) {
  const Eigen::Isometry2d moved = Eigen::Translation2d(offset.x, offset.y) * Eigen::Rotation2Dd(offset.heading);
  for (GeometryPiece& piece : road->geometry) {
    const Eigen::Vector2d begin = moved * Eigen::Vector2d{piece.x, piece.y};
    piece.x = begin.x();
    piece.y = begin.y();
    piece.heading += offset.heading;
  }
  if (offset.z == 0) return;
  // The height is 0 before the first record.
  std::vector<Cubic>& heights = road->elevation.cubics;
  if (heights.empty() || heights.front().s > 0) heights.insert(heights.begin(), Cubic{});
  for (Cubic& cubic : heights) cubic.a += offset.z;
}

bool is_left_hand(const Element& road_element) {
  const std::string rule = road_element.text("rule", "RHT");
  if (rule != "RHT" && rule != "LHT") road_element.fail("attribute rule: expected RHT or LHT, got '{}'", rule);
  return rule == "LHT";
}

/// Reads the speed limits of a road's <type> elements. Each applies from its s on.
Profile read_road_speed_limits(const Element& road_element, double road_length) {
  Profile limits;
  road_element.each("type", [&](const Element& type) {
    const std::optional<double> s = read_station(type, "s", road_length);
    const Element speed = type.child("speed");
    const std::optional<double> limit = speed ? read_speed_mps(speed) : 0;
    if (s && limit) append_record(type, "s", &Cubic::s, {.s = *s, .a = *limit}, &limits.cubics);
  });
  sort_records(&Cubic::s, &limits.cubics);
  return limits;
}

FileRoad read_road(const Element& element, const Offset& offset, Faults* faults) {
  FileRoad road;
  road.where = element.where();
  road.id = element.text("id");
  road.length = element.number_in("length", 0, kMaxRoadLength_m);
  const std::string junction = element.text("junction", "-1");
  if (junction != "-1") road.junction = junction;
  road.left_hand = is_left_hand(element);
  read_road_links(element, &road);
  const double described = read_reference_line(element, &road);
  road.speed_limit_mps = read_road_speed_limits(element, road.length);
  read_lanes(element, faults, &road);
  hold_profiles(described, &road);
  read_objects(element, &road);
  read_signals(element, &road);
  apply(offset, &road);
  return road;
}

/// Appends `item`, whose id must be unique.
template <typename Item>
void append(Item item, const Element& element, std::vector<Item>* items, std::unordered_map<std::string, int>* index) {
  if (!index->emplace(item.id, static_cast<int>(items->size())).second) {
    element.fail("attribute id: another {} already has it", element.name());
  }
  items->push_back(std::move(item));
}

std::string name_of(const Element& element) { return fmt::format("{} {}", element.name(), element.text("id")); }

}  // namespace

std::optional<double> read_speed_mps(const Element& element) {
  const std::string max = element.text("max", "");
  if (max == "no limit" || max == "undefined") return 0;
  const std::optional<double> value = element.finite_number("max");
  if (!value || !(*value >= 0 && *value <= kMaxSpeed)) {
    element.record_repair(RepairKind::unreadable_speed, "attribute max: expected a number in [0, {}], got '{}'",
                          kMaxSpeed, max);
    return std::nullopt;
  }
  const std::string unit = element.text("unit", "m/s");
  if (unit == "m/s") return *value;
  if (unit == "km/h") return *value / 3.6;
  if (unit == "mph") return *value * 0.44704;
  element.record_repair(RepairKind::unreadable_speed, "attribute unit: expected m/s, km/h or mph, got '{}'", unit);
  return std::nullopt;
}

void read_network(std::string_view text, const std::string& source_name, Faults* faults, Network* network_out) {
  const InterruptibleWork work(fmt::format("{}: interrupted while it was read", source_name));
  Network& network = *network_out;
  network = Network();
  network.source = Source(source_name, text);
  pugi::xml_document document;
  read_document(text, network.source, &document);
  const std::string file = "file";
  const Element root(document.child("OpenDRIVE"), &network.source, faults, &file);
  if (!root) {
    pictura::fail("{}: expected OpenDRIVE, got an XML file whose root is <{}>", source_name,
                  document.document_element().name());
  }
  const Offset offset = read_header(root.child("header"), &network.geo_reference);
  root.each("road", [&](const Element& element) {
    work.check();
    const std::string name = name_of(element);
    const Element road = element.with_owner(&name);
    append(read_road(road, offset, faults), road, &network.roads, &network.road_index);
    check_extent(network.roads.back(), faults);
  });
  if (network.roads.empty()) root.fail("expected at least one <road> inside, found none");
  root.each("junction", [&](const Element& element) {
    const std::string name = name_of(element);
    const Element junction = element.with_owner(&name);
    append(read_junction(junction), junction, &network.junctions, &network.junction_index);
  });
  root.each("controller", [&](const Element& element) {
    const std::string name = name_of(element);
    network.controllers.push_back(read_controller(element.with_owner(&name)));
  });
  repair_links(&network, faults);
}

}  // namespace pictura::opendrive
