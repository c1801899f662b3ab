#include "pictura/map/opendrive/reader.h"

#include <pugixml.hpp>

#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

FileRoad read_road(const Element& element) {
  FileRoad road;
  road.where = element.where();
  road.id = element.text("id");
  road.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (road.length == 0) element.fail("attribute length: expected more than 0");
  const std::string junction = element.text("junction", "-1");
  if (junction != "-1") road.junction = junction;
  if (element.text("rule", "RHT") != "RHT") element.fail("attribute rule: only right-hand traffic (RHT) is supported");
  read_road_links(element, &road);
  element.each("type", [&](const Element& type) {
    const Element speed = type.child("speed");
    road.speed_limit_mps.cubics.push_back(
        {.s = type.number_in("s", 0, road.length), .a = speed ? read_speed_mps(speed) : 0});
  });
  read_reference_line(element, &road);
  read_lanes(element, &road);
  read_objects(element, &road);
  read_signals(element, &road);
  return road;
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

void read_network(std::string_view text, const std::string& source_name, Network* network_out) {
  Network& network = *network_out;
  network = Network();
  network.source = Source(source_name, text);
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    pictura::fail("{}:{}: expected well-formed XML: {}", source_name, network.source.line_at(parsed.offset),
                  parsed.description());
  }
  const Element root(document.child("OpenDRIVE"), &network.source, "file");
  if (!root) {
    pictura::fail("{}: expected OpenDRIVE, got an XML file whose root is <{}>", source_name,
                  document.document_element().name());
  }
  root.each("road", [&](const Element& element) {
    const Element road = element.with_owner(fmt::format("road {}", element.text("id")));
    network.roads.push_back(read_road(road));
    if (!network.road_index.emplace(network.roads.back().id, static_cast<int>(network.roads.size()) - 1).second) {
      road.fail("attribute id: another road has it already");
    }
  });
  if (network.roads.empty()) root.fail("expected at least one <road> in it, found none");
  root.each("junction", [&](const Element& element) {
    const Element junction = element.with_owner(fmt::format("junction {}", element.text("id")));
    network.junctions.push_back(read_junction(junction));
    const int index = static_cast<int>(network.junctions.size()) - 1;
    if (!network.junction_index.emplace(network.junctions.back().id, index).second) {
      junction.fail("attribute id: another junction has it already");
    }
  });
  root.each("controller", [&](const Element& element) { network.controllers.push_back(read_controller(element)); });
}

}  // namespace pictura::opendrive
