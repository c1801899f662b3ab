// Reads the connections of roads (links and junctions), and the controllers of traffic lights.
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

/// Sets the end of the road to which a link or connection refers. Records a missing or unknown end, which
/// repair_links() determines.
template <typename Link>
void read_contact(const Element& element, Link* link) {
  const std::string text = element.text("contactPoint", "");
  link->contact = text == "end" ? ContactPoint::end : ContactPoint::start;
  link->has_contact = text == "start" || text == "end";
  if (!element.has("contactPoint")) {
    element.record_repair(RepairKind::missing_contact, "attribute contactPoint is missing");
  } else if (!link->has_contact) {
    element.record_repair(RepairKind::missing_contact, "attribute contactPoint: expected start or end, got '{}'", text);
  }
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
      element.record_repair(RepairKind::link_into_road,
                            "attribute elementS: links to the middle of a road (virtual junctions) are not supported");
      return link;
    }
    link.kind = RoadLink::Kind::road;
    read_contact(element, &link);
  } else {
    element.fail("attribute elementType: expected road or junction, got '{}'", type);
  }
  return link;
}

Connection read_connection(const Element& element, bool is_direct) {
  Connection connection;
  connection.where = element.where();
  connection.incoming_road = element.text("incomingRoad");
  connection.connecting_road = element.text(is_direct ? "linkedRoad" : "connectingRoad");
  read_contact(element, &connection);
  element.each("laneLink", [&](const Element& link) {
    connection.lane_links.push_back({link.integer("from"), link.integer("to"), link.where()});
  });
  return connection;
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
  const std::string type = element.text("type", "default");
  junction.is_direct = type == "direct";
  if (type != "default" && !junction.is_direct) {
    // The junction is kept without connections, because roads refer to it.
    element.record_repair(RepairKind::unsupported_junction,
                          "attribute type: '{}' junctions are not supported; expected default or direct", type);
    return junction;
  }
  element.each("connection", [&](const Element& child) {
    junction.connections.push_back(read_connection(child, junction.is_direct));
  });
  element.each("controller", [&](const Element& child) { junction.controllers.push_back(child.text("id")); });
  return junction;
}

FileController read_controller(const Element& element) {
  FileController controller;
  controller.id = element.text("id");
  controller.where = element.where();
  controller.sequence = element.has("sequence") ? element.integer("sequence") : 0;
  element.each("control", [&](const Element& control) { controller.signals.push_back(control.text("signalId")); });
  return controller;
}

}  // namespace pictura::opendrive
