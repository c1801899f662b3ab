// Reads how roads are connected: links, junctions, and the controllers of traffic lights.
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

ContactPoint contact_point(const Element& element) {
  const std::string text = element.text("contactPoint");
  if (text == "start") return ContactPoint::start;
  if (text == "end") return ContactPoint::end;
  element.fail("attribute contactPoint: expected start or end, got '{}'", text);
}

RoadLink read_road_link(const Element& element) {
  RoadLink link;
  if (!element) return link;
  link.where = element.where();
  link.id = element.text("elementId");
  const std::string type = element.text("elementType");
  if (type == "junction") {
    link.kind = RoadLink::Kind::junction;
  } else if (type == "road") {
    if (element.has("elementS")) {
      element.fail("attribute elementS: links to the middle of a road (virtual junctions) are not supported");
    }
    link.kind = RoadLink::Kind::road;
    link.contact = contact_point(element);
  } else {
    element.fail("attribute elementType: expected road or junction, got '{}'", type);
  }
  return link;
}

Connection read_connection(const Element& element, bool is_direct, Faults* faults) {
  Connection connection;
  connection.where = element.where();
  connection.incoming_road = element.text("incomingRoad");
  connection.connecting_road = element.text(is_direct ? "linkedRoad" : "connectingRoad");
  connection.contact = contact_point(element);
  element.each("laneLink", [&](const Element& link) {
    faults->attempt([&] { connection.lane_links.push_back({link.integer("from"), link.integer("to"), link.where()}); });
  });
  return connection;
}

}  // namespace

void read_road_links(const Element& road_element, Faults* faults, FileRoad* road) {
  const Element link = road_element.child("link");
  if (!link) return;
  faults->attempt([&] { road->predecessor = read_road_link(link.child("predecessor")); });
  faults->attempt([&] { road->successor = read_road_link(link.child("successor")); });
}

FileJunction read_junction(const Element& element, Faults* faults) {
  FileJunction junction;
  junction.where = element.where();
  junction.id = element.text("id");
  const std::string type = element.text("type", "default");
  junction.is_direct = type == "direct";
  const bool is_read = faults->attempt([&] {
    if (type != "default" && !junction.is_direct) {
      element.fail("attribute type: '{}' junctions are not supported; expected default or direct", type);
    }
  });
  // In lenient mode an unsupported junction is kept without connections, since roads refer to it.
  if (!is_read) return junction;
  element.each("connection", [&](const Element& child) {
    faults->attempt([&] { junction.connections.push_back(read_connection(child, junction.is_direct, faults)); });
  });
  element.each("controller", [&](const Element& child) {
    faults->attempt([&] { junction.controllers.push_back(child.text("id")); });
  });
  return junction;
}

FileController read_controller(const Element& element, Faults* faults) {
  FileController controller;
  controller.id = element.text("id");
  const Element owned = element.with_owner(fmt::format("controller {}", controller.id));
  controller.where = owned.where();
  controller.sequence = owned.has("sequence") ? owned.integer("sequence") : 0;
  owned.each("control", [&](const Element& control) {
    faults->attempt([&] { controller.signals.push_back(control.text("signalId")); });
  });
  return controller;
}

}  // namespace pictura::opendrive
