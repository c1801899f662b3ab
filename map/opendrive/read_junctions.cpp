// How roads are joined: links, junctions, and the controllers of their lights.
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
    link.kind = RoadLink::Kind::road;
    link.contact = contact_point(element);
  } else {
    element.fail("attribute elementType: expected road or junction, got '{}'", type);
  }
  return link;
}

}  // namespace

void read_road_links(const Element& road_element, FileRoad* road) {
  const Element link = road_element.child("link");
  if (!link) return;
  road->predecessor = read_road_link(link.child("predecessor"));
  road->successor = read_road_link(link.child("successor"));
}

FileJunction read_junction(const Element& element) {
  FileJunction junction;
  junction.where = element.where();
  junction.id = element.text("id");
  if (const std::string type = element.text("type", "default"); type != "default") {
    element.fail("attribute type: '{}' junctions are not supported", type);
  }
  element.each("connection", [&](const Element& child) {
    Connection connection;
    connection.where = child.where();
    connection.incoming_road = child.text("incomingRoad");
    connection.connecting_road = child.text("connectingRoad");
    connection.contact = contact_point(child);
    child.each("laneLink", [&](const Element& link) {
      connection.lane_links.push_back({link.integer("from"), link.integer("to")});
    });
    junction.connections.push_back(std::move(connection));
  });
  element.each("controller", [&](const Element& child) { junction.controllers.push_back(child.text("id")); });
  return junction;
}

FileController read_controller(const Element& element) {
  FileController controller;
  controller.id = element.text("id");
  controller.where = element.with_owner(fmt::format("controller {}", controller.id)).where();
  controller.sequence = element.has("sequence") ? element.integer("sequence") : 0;
  element.each("control", [&](const Element& control) { controller.signals.push_back(control.text("signalId")); });
  return controller;
}

}  // namespace pictura::opendrive
