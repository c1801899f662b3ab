#include "pictura/map/opendrive/writer.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <sstream>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>
#include <pugixml.hpp>

#include "pictura/map/opendrive/reader.h"

namespace pictura::opendrive {

namespace {

/// Value of an attribute. A number is printed by fmt with the fewest digits that read back as the same double.
class Value {
 public:
  Value(const std::string& text) : text_(text) {}
  Value(const char* text) : text_(text) {}
  Value(double number) : text_(fmt::format("{}", number)) {}
  Value(int number) : text_(fmt::format("{}", number)) {}
  Value(ContactPoint contact) : text_(contact == ContactPoint::start ? "start" : "end") {}

  const char* text() const { return text_.c_str(); }

 private:
  std::string text_;
};

pugi::xml_node add(pugi::xml_node parent, const char* name,
                   std::initializer_list<std::pair<const char*, Value>> attributes = {}) {
  pugi::xml_node node = parent.append_child(name);
  for (const auto& [key, value] : attributes) node.append_attribute(key).set_value(value.text());
  return node;
}

void set(pugi::xml_node node, const char* key, const Value& value) {
  node.append_attribute(key).set_value(value.text());
}

void add_profile(pugi::xml_node parent, const char* name, const char* station, const Profile& profile) {
  for (const Cubic& cubic : profile.cubics)
    add(parent, name, {{station, cubic.s}, {"a", cubic.a}, {"b", cubic.b}, {"c", cubic.c}, {"d", cubic.d}});
}

void add_road_link(pugi::xml_node link, const char* name, const RoadLink& road_link) {
  switch (road_link.kind) {
    case RoadLink::Kind::none: return;
    case RoadLink::Kind::road:
      add(link, name, {{"elementType", "road"}, {"elementId", road_link.id}, {"contactPoint", road_link.contact}});
      return;
    case RoadLink::Kind::junction: add(link, name, {{"elementType", "junction"}, {"elementId", road_link.id}});
  }
}

void add_cubic_curve(pugi::xml_node geometry, const GeometryPiece& piece) {
  const auto& [u, v, p_end, arc_length] = *piece.cubic;
  const bool is_normalized = p_end == 1;
  // A <poly3> has u = p, and its p_end follows from the length of the piece.
  if (u == std::array<double, 4>{0, 1, 0, 0} && !is_normalized && p_end != piece.length) {
    add(geometry, "poly3", {{"a", v[0]}, {"b", v[1]}, {"c", v[2]}, {"d", v[3]}});
    return;
  }
  add(geometry, "paramPoly3",
      {{"aU", u[0]},
       {"bU", u[1]},
       {"cU", u[2]},
       {"dU", u[3]},
       {"aV", v[0]},
       {"bV", v[1]},
       {"cV", v[2]},
       {"dV", v[3]},
       {"pRange", is_normalized ? "normalized" : "arcLength"}});
}

void add_geometry(pugi::xml_node plan_view, const GeometryPiece& piece) {
  const pugi::xml_node geometry =
      add(plan_view, "geometry",
          {{"s", piece.s}, {"x", piece.x}, {"y", piece.y}, {"hdg", piece.heading}, {"length", piece.length}});
  if (piece.cubic) {
    add_cubic_curve(geometry, piece);
  } else if (piece.start_curvature != piece.end_curvature) {
    add(geometry, "spiral", {{"curvStart", piece.start_curvature}, {"curvEnd", piece.end_curvature}});
  } else if (piece.start_curvature != 0) {
    add(geometry, "arc", {{"curvature", piece.start_curvature}});
  } else {
    add(geometry, "line");
  }
}

void add_banking(pugi::xml_node road_node, const FileRoad& road) {
  if (road.superelevation.cubics.empty() && road.left_crossfall.cubics.empty() && road.right_crossfall.cubics.empty() &&
      road.shape.empty()) {
    return;
  }
  const pugi::xml_node lateral = add(road_node, "lateralProfile");
  add_profile(lateral, "superelevation", "s", road.superelevation);
  for (const auto& [side, profile] : {std::pair{"left", &road.left_crossfall}, {"right", &road.right_crossfall}}) {
    for (const Cubic& cubic : profile->cubics) {
      add(lateral, "crossfall",
          {{"side", side}, {"s", cubic.s}, {"a", cubic.a}, {"b", cubic.b}, {"c", cubic.c}, {"d", cubic.d}});
    }
  }
  for (const CrossSection& section : road.shape) {
    for (const Cubic& cubic : section.height.cubics) {
      add(lateral, "shape",
          {{"s", section.s}, {"t", cubic.s}, {"a", cubic.a}, {"b", cubic.b}, {"c", cubic.c}, {"d", cubic.d}});
    }
  }
}

const char* to_text(LaneChange change) {
  switch (change) {
    case LaneChange::both: return "both";
    case LaneChange::increase: return "increase";
    case LaneChange::decrease: return "decrease";
    case LaneChange::none: return "none";
  }
  return "both";
}

void add_mark_line(pugi::xml_node parent, const MarkLine& line, bool is_explicit) {
  pugi::xml_node node = add(parent, "line", {{"length", line.length}});
  if (!is_explicit) set(node, "space", line.space);
  set(node, "tOffset", line.t_offset);
  set(node, "sOffset", line.s_offset);
  if (line.width > 0) set(node, "width", line.width);
  if (line.color) set(node, "color", to_string(*line.color));
}

void add_mark(pugi::xml_node lane, const RoadMark& mark) {
  pugi::xml_node node = add(lane, "roadMark",
                            {{"sOffset", mark.s_offset},
                             {"type", mark.type},
                             {"weight", mark.bold ? "bold" : "standard"},
                             {"color", to_string(mark.color)},
                             {"laneChange", to_text(mark.lane_change)}});
  if (mark.width > 0) set(node, "width", mark.width);
  add_profile(node, "sway", "ds", mark.sway);
  if (!mark.lines.empty()) {
    const pugi::xml_node type = add(node, "type", {{"name", mark.type}, {"width", mark.width}});
    for (const MarkLine& line : mark.lines) add_mark_line(type, line, false);
  }
  if (!mark.explicit_lines.empty()) {
    const pugi::xml_node lines = add(node, "explicit");
    for (const MarkLine& line : mark.explicit_lines) add_mark_line(lines, line, true);
  }
}

void add_speed(pugi::xml_node parent, double limit_mps, const double* station = nullptr) {
  pugi::xml_node speed = add(parent, "speed");
  if (station) set(speed, "sOffset", *station);
  if (limit_mps > 0) {
    set(speed, "max", limit_mps);
    set(speed, "unit", "m/s");
  } else {
    set(speed, "max", "no limit");
  }
}

/// Adds a lane. `successors` are the successors of the whole <lane>, which may continue in later sections.
void add_lane(pugi::xml_node side, const FileLane& lane, const std::vector<int>& successors) {
  pugi::xml_node node =
      add(side, "lane", {{"id", lane.id}, {"type", lane.type_name}, {"level", lane.is_level ? "true" : "false"}});
  if (lane.direction == LaneDirection::reversed) set(node, "direction", "reversed");
  if (lane.direction == LaneDirection::both) set(node, "direction", "both");
  if (!lane.predecessors.empty() || !successors.empty()) {
    const pugi::xml_node link = add(node, "link");
    for (const int id : lane.predecessors) add(link, "predecessor", {{"id", id}});
    for (const int id : successors) add(link, "successor", {{"id", id}});
  }
  add_profile(node, "width", "sOffset", lane.width);
  add_profile(node, "border", "sOffset", lane.border);
  for (const RoadMark& mark : lane.marks) add_mark(node, mark);
  for (const Cubic& limit : lane.speed_limit_mps.cubics) add_speed(node, limit.a, &limit.s);
  for (std::size_t i = 0; i < lane.inner_height.cubics.size(); ++i) {
    add(node, "height",
        {{"sOffset", lane.inner_height.cubics[i].s},
         {"inner", lane.inner_height.cubics[i].a},
         {"outer", lane.outer_height.cubics[i].a}});
  }
}

bool is_continued(const std::vector<FileLane>& side) { return !side.empty() && side.front().is_continued; }

/// Returns the successors of a lane. If the lane continues in later sections, returns the successors of its last part.
std::vector<int> successors_of(const FileRoad& road, std::size_t section, const FileLane& lane) {
  while (section + 1 < road.sections.size()) {
    const FileLane* next = road.sections[section + 1].lane(lane.id);
    if (!next || !next->is_continued) break;
    ++section;
  }
  const FileLane* last = road.sections[section].lane(lane.id);
  return last ? last->successors : lane.successors;
}

void add_section(pugi::xml_node lanes, const FileRoad& road, std::size_t index) {
  const FileSection& section = road.sections[index];
  pugi::xml_node node = add(lanes, "laneSection", {{"s", section.s}});
  const bool left_continues = is_continued(section.left), right_continues = is_continued(section.right);
  if (left_continues || right_continues) set(node, "singleSide", "true");
  // The standard orders lanes from left to right.
  if (!section.left.empty() && !left_continues) {
    const pugi::xml_node left = add(node, "left");
    for (auto lane = section.left.rbegin(); lane != section.left.rend(); ++lane) {
      add_lane(left, *lane, successors_of(road, index, *lane));
    }
  }
  FileLane center = section.center;
  if (center.type_name.empty()) center.type_name = "none";
  add_lane(add(node, "center"), center, center.successors);
  if (!section.right.empty() && !right_continues) {
    const pugi::xml_node right = add(node, "right");
    for (const FileLane& lane : section.right) add_lane(right, lane, successors_of(road, index, lane));
  }
}

const char* to_text(Orientation orientation) {
  switch (orientation) {
    case Orientation::along: return "+";
    case Orientation::against: return "-";
    case Orientation::either: return "none";
  }
  return "none";
}

void add_validity(pugi::xml_node parent, const std::vector<LaneRange>& ranges) {
  for (const LaneRange& range : ranges) add(parent, "validity", {{"fromLane", range.from}, {"toLane", range.to}});
}

void add_object(pugi::xml_node objects, const FileObject& object, const std::string& id) {
  pugi::xml_node node = add(objects, "object", {{"id", id}});
  if (!object.name.empty()) set(node, "name", object.name);
  switch (object.kind) {
    case FileObject::Kind::crosswalk: set(node, "type", "crosswalk"); break;
    case FileObject::Kind::parking_space: set(node, "type", "parkingSpace"); break;
    case FileObject::Kind::stop_line:
      set(node, "type", "roadMark");
      set(node, "subtype", "signalLines");
      break;
  }
  set(node, "s", object.s);
  set(node, "t", object.t);
  set(node, "zOffset", object.z_offset);
  set(node, "orientation", "none");
  set(node, "hdg", object.heading);
  set(node, "length", object.length);
  set(node, "width", object.width);
  if (object.outline.empty()) return;
  const pugi::xml_node outline = add(node, "outline");
  for (const FileObject::Corner& corner : object.outline) {
    if (corner.along_road) {
      add(outline, "cornerRoad", {{"s", corner.u}, {"t", corner.v}, {"dz", corner.z}, {"height", 0}});
    } else {
      add(outline, "cornerLocal", {{"u", corner.u}, {"v", corner.v}, {"z", corner.z}, {"height", 0}});
    }
  }
}

void add_signals(pugi::xml_node road_node, const FileRoad& road) {
  if (road.signals.empty() && road.signal_references.empty()) return;
  const pugi::xml_node signals = add(road_node, "signals");
  for (const FileSignal& signal : road.signals) {
    pugi::xml_node node = add(signals, "signal", {{"s", signal.s}, {"t", signal.t}, {"id", signal.id}});
    if (!signal.name.empty()) set(node, "name", signal.name);
    set(node, "dynamic", signal.is_dynamic ? "yes" : "no");
    set(node, "orientation", to_text(signal.orientation));
    set(node, "zOffset", signal.z_offset);
    if (!signal.country.empty()) set(node, "country", signal.country);
    set(node, "type", signal.type);
    set(node, "subtype", signal.subtype);
    set(node, "hOffset", signal.heading_offset);
    add_validity(node, signal.validity);
  }
  for (const SignalReference& reference : road.signal_references) {
    const pugi::xml_node node = add(signals, "signalReference",
                                    {{"s", reference.s},
                                     {"t", reference.t},
                                     {"id", reference.signal},
                                     {"orientation", to_text(reference.orientation)}});
    add_validity(node, reference.validity);
  }
}

/// Assigns object ids. An object gets its own id, or a new id if its own is empty or already used in the file. For
/// example, copies of a <repeat> have the same id.
class ObjectIds {
 public:
  explicit ObjectIds(const Network& network) {
    for (const FileRoad& road : network.roads) {
      for (const FileObject& object : road.objects) known_.insert(object.id);
    }
  }

  std::string id_of(const FileObject& object) {
    if (!object.id.empty() && written_.insert(object.id).second) return object.id;
    std::string id;
    do {
      id = fmt::format("{}{}{}", object.id, object.id.empty() ? "" : "-", ++last_);
    } while (known_.contains(id) || !written_.insert(id).second);
    return id;
  }

 private:
  std::unordered_set<std::string> known_, written_;
  int last_ = 0;
};

void add_road(pugi::xml_node root, const FileRoad& road, ObjectIds* object_ids) {
  pugi::xml_node node = add(root, "road", {{"length", road.length}, {"id", road.id}});
  set(node, "junction", road.junction.empty() ? "-1" : road.junction);
  if (road.left_hand) set(node, "rule", "LHT");
  const pugi::xml_node link = add(node, "link");
  add_road_link(link, "predecessor", road.predecessor);
  add_road_link(link, "successor", road.successor);
  for (const Cubic& limit : road.speed_limit_mps.cubics) {
    const pugi::xml_node type = add(node, "type", {{"s", limit.s}, {"type", "unknown"}});
    if (limit.a > 0) add_speed(type, limit.a);
  }
  const pugi::xml_node plan_view = add(node, "planView");
  for (const GeometryPiece& piece : road.geometry) add_geometry(plan_view, piece);
  if (!road.elevation.cubics.empty()) add_profile(add(node, "elevationProfile"), "elevation", "s", road.elevation);
  add_banking(node, road);
  const pugi::xml_node lanes = add(node, "lanes");
  add_profile(lanes, "laneOffset", "s", road.lane_offset);
  for (std::size_t i = 0; i < road.sections.size(); ++i) add_section(lanes, road, i);
  if (!road.objects.empty()) {
    const pugi::xml_node objects = add(node, "objects");
    for (const FileObject& object : road.objects) add_object(objects, object, object_ids->id_of(object));
  }
  add_signals(node, road);
}

void add_junction(pugi::xml_node root, const FileJunction& junction) {
  const pugi::xml_node node =
      add(root, "junction", {{"id", junction.id}, {"name", ""}, {"type", junction.is_direct ? "direct" : "default"}});
  for (std::size_t i = 0; i < junction.connections.size(); ++i) {
    const Connection& connection = junction.connections[i];
    const pugi::xml_node element =
        add(node, "connection",
            {{"id", static_cast<int>(i)},
             {"incomingRoad", connection.incoming_road},
             {junction.is_direct ? "linkedRoad" : "connectingRoad", connection.connecting_road},
             {"contactPoint", connection.contact}});
    for (const LaneLink& link : connection.lane_links) add(element, "laneLink", {{"from", link.from}, {"to", link.to}});
  }
  for (const std::string& controller : junction.controllers) add(node, "controller", {{"id", controller}});
}

void add_controller(pugi::xml_node root, const FileController& controller) {
  const pugi::xml_node node =
      add(root, "controller", {{"id", controller.id}, {"name", ""}, {"sequence", controller.sequence}});
  for (const std::string& signal : controller.signals) add(node, "control", {{"signalId", signal}});
}

/// Returns the minor revision: 4 (OpenDRIVE 1.4), or 8 (1.8) if the network uses newer features.
int minor_revision(const Network& network) {
  const auto is_new = [](const FileLane& lane) {
    return lane.direction != LaneDirection::standard || lane.predecessors.size() > 1 || lane.successors.size() > 1;
  };
  for (const FileRoad& road : network.roads) {
    if (road.left_hand) return 8;
    for (const FileSection& section : road.sections) {
      if (std::any_of(section.left.begin(), section.left.end(), is_new)) return 8;
      if (std::any_of(section.right.begin(), section.right.end(), is_new)) return 8;
    }
  }
  const bool has_direct = std::any_of(network.junctions.begin(), network.junctions.end(),
                                      [](const FileJunction& junction) { return junction.is_direct; });
  return has_direct ? 8 : 4;
}

}  // namespace

std::string write_opendrive(const Network& network) {
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version").set_value("1.0");
  declaration.append_attribute("encoding").set_value("UTF-8");
  const pugi::xml_node root = document.append_child("OpenDRIVE");
  const pugi::xml_node header =
      add(root, "header", {{"revMajor", 1}, {"revMinor", minor_revision(network)}, {"vendor", "pictura"}});
  if (!network.geo_reference.empty()) {
    add(header, "geoReference").append_child(pugi::node_cdata).set_value(network.geo_reference.c_str());
  }
  ObjectIds object_ids(network);
  for (const FileRoad& road : network.roads) add_road(root, road, &object_ids);
  for (const FileController& controller : network.controllers) add_controller(root, controller);
  for (const FileJunction& junction : network.junctions) add_junction(root, junction);
  std::ostringstream out;
  document.save(out, " ");
  return out.str();
}

}  // namespace pictura::opendrive

namespace pictura {

std::string export_opendrive(std::string_view text, const std::string& source) {
  opendrive::Faults faults(false);
  opendrive::Network network;
  opendrive::read_network(text, source, &faults, &network);
  return opendrive::write_opendrive(network);
}

}  // namespace pictura
