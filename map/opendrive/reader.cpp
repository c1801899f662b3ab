#include "pictura/map/opendrive/reader.h"

#include <Eigen/Geometry>

#include "pictura/map/opendrive/document.h"
#include "pictura/map/opendrive/extent.h"
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

constexpr double kMinRoadLength_m = 1e-3;

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
  if (road->elevation.cubics.empty()) road->elevation.cubics.push_back({});
  for (Cubic& cubic : road->elevation.cubics) cubic.a += offset.z;
}

bool is_left_hand(const Element& road_element) {
  const std::string rule = road_element.text("rule", "RHT");
  if (rule != "RHT" && rule != "LHT") road_element.fail("attribute rule: expected RHT or LHT, got '{}'", rule);
  return rule == "LHT";
}

FileRoad read_road(const Element& element, const Offset& offset, Faults* faults) {
  FileRoad road;
  road.where = element.where();
  road.id = element.text("id");
  road.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (road.length < kMinRoadLength_m) {
    element.fail("attribute length: expected at least {}, got {}", kMinRoadLength_m, road.length);
  }
  const std::string junction = element.text("junction", "-1");
  if (junction != "-1") road.junction = junction;
  road.left_hand = is_left_hand(element);
  read_road_links(element, faults, &road);
  element.each("type", [&](const Element& type) {
    faults->attempt([&] {
      const Element speed = type.child("speed");
      append_cubic(type, {.s = type.number_in("s", 0, road.length), .a = speed ? read_speed_mps(speed) : 0},
                   &road.speed_limit_mps);
    });
  });
  read_reference_line(element, &road);
  read_lanes(element, faults, &road);
  read_objects(element, faults, &road);
  read_signals(element, faults, &road);
  apply(offset, &road);
  check_extent(faults, &road);
  return road;
}

/// Appends `item`, whose id must be unique.
template <typename Item>
void append(Item item, const Element& element, std::vector<Item>* items, std::unordered_map<std::string, int>* index) {
  if (!index->emplace(item.id, static_cast<int>(items->size())).second) {
    element.fail("attribute id: another {} has it already", element.name());
  }
  items->push_back(std::move(item));
}

Element owned(const Element& element) {
  return element.with_owner(fmt::format("{} {}", element.name(), element.text("id")));
}

}  // namespace

double read_speed_mps(const Element& element) {
  const std::string max = element.text("max");
  if (max == "no limit" || max == "undefined") return 0;
  const double value = element.number_in("max", 0, 1000);
  const std::string unit = element.text("unit", "m/s");
  if (unit == "m/s") return value;
  if (unit == "km/h") return value / 3.6;
  if (unit == "mph") return value * 0.44704;
  element.fail("attribute unit: expected m/s, km/h or mph, got '{}'", unit);
}

void read_network(std::string_view text, const std::string& source_name, Faults* faults, Network* network_out) {
  Network& network = *network_out;
  network = Network();
  network.source = Source(source_name, text);
  pugi::xml_document document;
  read_document(text, network.source, &document);
  const Element root(document.child("OpenDRIVE"), &network.source, "file");
  if (!root) {
    pictura::fail("{}: expected OpenDRIVE, got an XML file whose root is <{}>", source_name,
                  document.document_element().name());
  }
  if (const Element include = root.child("include")) include.fail("files of several parts are not supported");
  Offset offset;
  faults->attempt([&] { offset = read_header(root.child("header"), &network.geo_reference); });
  root.each("road", [&](const Element& element) {
    faults->attempt([&] {
      const Element road = owned(element);
      append(read_road(road, offset, faults), road, &network.roads, &network.road_index);
    });
  });
  if (network.roads.empty()) root.fail("expected at least one valid <road> in it, found none");
  root.each("junction", [&](const Element& element) {
    faults->attempt([&] {
      const Element junction = owned(element);
      append(read_junction(junction, faults), junction, &network.junctions, &network.junction_index);
    });
  });
  root.each("controller", [&](const Element& element) {
    faults->attempt([&] { network.controllers.push_back(read_controller(element, faults)); });
  });
}

}  // namespace pictura::opendrive
