#include "pictura/map/opendrive_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include <pugixml.hpp>

#include "pictura/map/opendrive_curves.h"

namespace pictura::opendrive {

namespace {

constexpr double kMaxRoadLength_m = 1e5;
constexpr double kMaxCoordinate_m = 1e8;
constexpr double kMaxTurn_rad = 100.0;  // of one geometry: 16 turns of a helix are enough
constexpr double kMaxGap_m = 0.1;       // between two geometries of a reference line
constexpr double kStationTolerance_m = 1e-3;
// Sections that editors leave behind when they snap; no lane can be built from less.
constexpr double kMinSection_m = 1e-3;
constexpr double kMaxLaneWidth_m = 1e3;
constexpr int kMaxLanesPerSide = 64;

std::string_view trim(std::string_view text) {
  const char* const blanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// An XML element together with what it belongs to; every reader of attributes checks and names what is wrong.
class Element {
 public:
  Element(pugi::xml_node node, const Source* source, std::string owner)
      : node_(node), source_(source), owner_(std::move(owner)) {}

  Where where() const { return {source_, node_.offset_debug(), owner_, element_name()}; }
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    where().fail_with(fmt::format(format, std::forward<Args>(args)...));
  }

  explicit operator bool() const { return static_cast<bool>(node_); }
  Element child(const char* name) const { return {node_.child(name), source_, owner_}; }
  Element needed_child(const char* name) const {
    const Element element = child(name);
    if (!element) fail("expected a <{}> in it, found none", name);
    return element;
  }
  /// Calls visit(Element) for every child of that name.
  template <typename Visit>
  void each(const char* name, Visit&& visit) const {
    for (const pugi::xml_node node : node_.children(name)) visit(Element(node, source_, owner_));
  }
  template <typename Visit>
  void each_child(Visit&& visit) const {
    for (const pugi::xml_node node : node_.children()) {
      if (node.type() == pugi::node_element) visit(Element(node, source_, owner_));
    }
  }
  std::string_view name() const { return node_.name(); }
  Element with_owner(std::string owner) const { return {node_, source_, std::move(owner)}; }

  bool has(const char* attribute) const { return static_cast<bool>(node_.attribute(attribute)); }
  std::string text(const char* attribute) const {
    const pugi::xml_attribute found = node_.attribute(attribute);
    if (!found) fail("attribute {} is missing", attribute);
    return found.value();
  }
  std::string text(const char* attribute, const char* fallback) const {
    return node_.attribute(attribute).as_string(fallback);
  }
  double number(const char* attribute) const {
    const std::string value = text(attribute);
    std::string_view digits = trim(value);
    if (digits.starts_with('+')) digits.remove_prefix(1);
    double result = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result);
    if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(result)) {
      fail("attribute {}: expected a finite number, got '{}'", attribute, value);
    }
    return result;
  }
  double number(const char* attribute, double fallback) const { return has(attribute) ? number(attribute) : fallback; }
  double number_in(const char* attribute, double low, double high) const {
    const double value = number(attribute);
    if (!(value >= low && value <= high)) {
      fail("attribute {}: expected a number in [{}, {}], got {}", attribute, low, high, value);
    }
    return value;
  }
  int integer(const char* attribute) const {
    const std::string value = text(attribute);
    const std::string_view digits = trim(value);
    int result = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result);
    if (error != std::errc() || end != digits.data() + digits.size()) {
      fail("attribute {}: expected an integer, got '{}'", attribute, value);
    }
    return result;
  }

 private:
  /// Points into the document, so it is only good while that lives; names of elements are copied from a fixed list.
  const char* element_name() const;

  pugi::xml_node node_;
  const Source* source_;
  std::string owner_;
};

const char* Element::element_name() const {
  static constexpr const char* kNames[] = {"OpenDRIVE",
                                           "road",
                                           "link",
                                           "predecessor",
                                           "successor",
                                           "type",
                                           "speed",
                                           "planView",
                                           "geometry",
                                           "line",
                                           "arc",
                                           "spiral",
                                           "poly3",
                                           "paramPoly3",
                                           "elevation",
                                           "lanes",
                                           "laneOffset",
                                           "laneSection",
                                           "left",
                                           "center",
                                           "right",
                                           "lane",
                                           "width",
                                           "border",
                                           "roadMark",
                                           "objects",
                                           "object",
                                           "outline",
                                           "cornerRoad",
                                           "signals",
                                           "cornerLocal",
                                           "signal",
                                           "signalReference",
                                           "validity",
                                           "controller",
                                           "control",
                                           "junction",
                                           "connection",
                                           "laneLink",
                                           "superelevation",
                                           "elevationProfile",
                                           "lateralProfile",
                                           "shape"};
  for (const char* known : kNames) {
    if (std::strcmp(known, node_.name()) == 0) return known;
  }
  return "element";
}

Profile read_profile(const Element& parent, const char* name, const char* station, double length) {
  Profile profile;
  if (!parent) return profile;
  parent.each(name, [&](const Element& element) {
    Cubic cubic;
    cubic.s = element.number_in(station, -kStationTolerance_m, length + kStationTolerance_m);
    cubic.a = element.number("a");
    cubic.b = element.number("b");
    cubic.c = element.number("c");
    cubic.d = element.number("d");
    if (!profile.cubics.empty() && cubic.s < profile.cubics.back().s) {
      element.fail("attribute {}: expected at least the previous one's {}, got {}", station, profile.cubics.back().s,
                   cubic.s);
    }
    profile.cubics.push_back(cubic);
  });
  return profile;
}

LaneType lane_type(const Element& element, const std::string& name) {
  static const std::unordered_map<std::string_view, LaneType> kTypes = {
      {"driving", LaneType::driving},
      {"bidirectional", LaneType::bidirectional},
      {"parking", LaneType::parking},
      {"ramp", LaneType::ramp},
      {"entry", LaneType::ramp},
      {"exit", LaneType::ramp},
      {"onRamp", LaneType::ramp},
      {"offRamp", LaneType::ramp},
      {"connectingRamp", LaneType::ramp},
      {"mwyEntry", LaneType::ramp},
      {"mwyExit", LaneType::ramp},
      {"shoulder", LaneType::shoulder},
      {"slipLane", LaneType::ramp},
      {"sidewalk", LaneType::sidewalk},
      {"walking", LaneType::sidewalk},
      {"biking", LaneType::biking},
      {"median", LaneType::median},
      {"border", LaneType::border},
      {"curb", LaneType::border},
      {"stop", LaneType::stop},
      {"restricted", LaneType::restricted},
      {"none", LaneType::other},
      {"special1", LaneType::other},
      {"special2", LaneType::other},
      {"special3", LaneType::other},
      {"roadWorks", LaneType::restricted},
      {"tram", LaneType::restricted},
      {"rail", LaneType::restricted},
      {"bus", LaneType::driving},
      {"taxi", LaneType::driving},
      {"HOV", LaneType::driving},
      {"shared", LaneType::driving},
  };
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) element.fail("attribute type: '{}' is not a lane type of OpenDRIVE 1.4 to 1.8", name);
  return found->second;
}

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

double speed_mps(const Element& element) {
  const std::string max = element.text("max");
  if (max == "no limit" || max == "undefined") return 0;
  const double value = element.number_in("max", 0, 1000);
  const std::string unit = element.text("unit", "m/s");
  if (unit == "m/s") return value;
  if (unit == "km/h") return value / 3.6;
  if (unit == "mph") return value * 0.44704;
  element.fail("attribute unit: expected m/s, km/h or mph, got '{}'", unit);
}

GeometryPiece read_geometry(const Element& element) {
  GeometryPiece piece;
  piece.s = element.number_in("s", 0, kMaxRoadLength_m);
  piece.x = element.number_in("x", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.y = element.number_in("y", -kMaxCoordinate_m, kMaxCoordinate_m);
  piece.heading = element.number_in("hdg", -1e3, 1e3);
  piece.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (piece.length == 0) element.fail("attribute length: expected more than 0");
  if (element.child("line")) return piece;
  if (const Element arc = element.child("arc")) {
    piece.start_curvature = piece.end_curvature = arc.number("curvature");
  } else if (const Element spiral = element.child("spiral")) {
    piece.start_curvature = spiral.number("curvStart");
    piece.end_curvature = spiral.number("curvEnd");
  } else {
    for (const char* other : {"poly3", "paramPoly3"}) {
      if (element.child(other)) element.fail("<{}> is not supported; expected <line>, <arc> or <spiral>", other);
    }
    element.fail("expected a <line>, <arc> or <spiral> in it, found none");
  }
  const double turn = std::max(std::abs(piece.start_curvature), std::abs(piece.end_curvature)) * piece.length;
  if (!(turn <= kMaxTurn_rad)) element.fail("expected a curve of at most {} rad, got {}", kMaxTurn_rad, turn);
  return piece;
}

void read_marks(const Element& lane, double section_length, std::vector<RoadMark>* marks_out) {
  lane.each("roadMark", [&](const Element& element) {
    RoadMark mark;
    mark.s_offset = element.number("sOffset", 0);
    // Marks that begin behind the section's end are met in CARLA's towns; they show nothing.
    if (mark.s_offset > section_length + kStationTolerance_m) return;
    if (!marks_out->empty() && mark.s_offset < marks_out->back().s_offset) {
      element.fail("attribute sOffset: expected at least the previous one's {}, got {}", marks_out->back().s_offset,
                   mark.s_offset);
    }
    mark.type = element.text("type");
    mark.color = element.text("color", "standard") == "yellow" ? MarkColor::yellow : MarkColor::white;
    if (element.has("width")) mark.width = element.number_in("width", 0, 10);
    marks_out->push_back(mark);
  });
}

FileLane read_lane(const Element& element, double section_length) {
  FileLane lane;
  lane.where = element.where();
  lane.id = element.integer("id");
  lane.type_name = element.text("type");
  lane.type = lane_type(element, lane.type_name);
  lane.is_void = lane.type_name == "none";
  if (const Element link = element.child("link")) {
    if (const Element end = link.child("predecessor")) lane.predecessor = end.integer("id");
    if (const Element end = link.child("successor")) lane.successor = end.integer("id");
  }
  read_marks(element, section_length, &lane.marks);
  if (lane.id == 0) return lane;
  lane.width = read_profile(element, "width", "sOffset", section_length);
  if (lane.width.cubics.empty()) {
    if (element.child("border")) element.fail("lanes given by <border> are not supported; expected <width>");
    element.fail("expected a <width> in it, found none");
  }
  if (std::abs(lane.width.cubics.front().s) > kStationTolerance_m) {
    element.fail("expected its first <width> at sOffset 0, got {}", lane.width.cubics.front().s);
  }
  for (const Cubic& cubic : lane.width.cubics) {
    if (!(cubic.a >= -kStationTolerance_m && cubic.a <= kMaxLaneWidth_m)) {
      element.fail("<width> attribute a: expected a width in [0, {}] m, got {}", kMaxLaneWidth_m, cubic.a);
    }
  }
  return lane;
}

void read_side(const Element& section, const char* side, int sign, double section_length,
               std::vector<FileLane>* lanes_out) {
  const Element parent = section.child(side);
  if (!parent) return;
  parent.each("lane", [&](const Element& element) {
    FileLane lane = read_lane(element, section_length);
    if (lane.id * sign <= 0) element.fail("attribute id: {} does not belong in <{}>", lane.id, side);
    lanes_out->push_back(std::move(lane));
  });
  if (lanes_out->size() > static_cast<std::size_t>(kMaxLanesPerSide)) {
    parent.fail("expected at most {} lanes, got {}", kMaxLanesPerSide, lanes_out->size());
  }
  std::sort(lanes_out->begin(), lanes_out->end(),
            [](const FileLane& a, const FileLane& b) { return std::abs(a.id) < std::abs(b.id); });
  for (std::size_t i = 0; i < lanes_out->size(); ++i) {
    if ((*lanes_out)[i].id != sign * (static_cast<int>(i) + 1)) {
      (*lanes_out)[i].where.fail("attribute id: expected {}, as lanes count from the center without gaps, got {}",
                                 sign * (static_cast<int>(i) + 1), (*lanes_out)[i].id);
    }
  }
}

/// Takes a section out of the road: its neighbours' lane links lead through it.
void bridge_section(std::vector<FileSection>* sections, std::size_t index) {
  const FileSection removed = (*sections)[index];
  auto lead_through = [&](FileSection& section, std::optional<int> FileLane::* link) {
    for (std::vector<FileLane>* side : {&section.left, &section.right}) {
      for (FileLane& lane : *side) {
        if (!(lane.*link)) continue;
        const FileLane* through = removed.lane(*(lane.*link));
        lane.*link = through ? through->*link : std::nullopt;
      }
    }
  };
  if (index > 0) {
    lead_through((*sections)[index - 1], &FileLane::successor);
    (*sections)[index - 1].end = removed.end;
  }
  if (index + 1 < sections->size()) {
    FileSection& next = (*sections)[index + 1];
    lead_through(next, &FileLane::predecessor);
    // Cubics and marks are relative to the section's start, which stays where it is.
  }
  sections->erase(sections->begin() + static_cast<std::ptrdiff_t>(index));
}

void read_lanes(const Element& road_element, FileRoad* road) {
  const Element lanes = road_element.needed_child("lanes");
  road->lane_offset = read_profile(lanes, "laneOffset", "s", road->length);
  std::vector<Element> elements;
  lanes.each("laneSection", [&](const Element& element) { elements.push_back(element); });
  if (elements.empty()) lanes.fail("expected a <laneSection> in it, found none");
  for (std::size_t i = 0; i < elements.size(); ++i) {
    FileSection section;
    section.s = elements[i].number_in("s", 0, road->length);
    section.end = i + 1 < elements.size() ? elements[i + 1].number_in("s", 0, road->length) : road->length;
    if (i == 0 && section.s > kStationTolerance_m) {
      elements[i].fail("attribute s: expected the first section at 0, got {}", section.s);
    }
    if (section.end < section.s) {
      elements[i + 1].fail("attribute s: expected at least the previous section's {}, got {}", section.s, section.end);
    }
    if (elements[i].text("singleSide", "false") == "true") {
      elements[i].fail("attribute singleSide: one-sided sections are not supported");
    }
    const double length = section.end - section.s;
    read_side(elements[i], "left", 1, length, &section.left);
    read_side(elements[i], "right", -1, length, &section.right);
    if (const Element center = elements[i].child("center")) {
      if (const Element lane = center.child("lane")) section.center = read_lane(lane, length);
    }
    road->sections.push_back(std::move(section));
  }
  for (std::size_t i = road->sections.size(); i-- > 0;) {
    if (road->sections.size() > 1 && road->sections[i].end - road->sections[i].s < kMinSection_m) {
      bridge_section(&road->sections, i);
    }
  }
}

void read_objects(const Element& road_element, FileRoad* road) {
  const Element objects = road_element.child("objects");
  if (!objects) return;
  objects.each("object", [&](const Element& element) {
    FileObject object;
    object.type = element.text("type", "none");
    if (object.type != "crosswalk" && object.type != "parking" && object.type != "parkingSpace") return;
    object.where = element.where();
    object.s = element.number_in("s", -kMaxRoadLength_m, kMaxRoadLength_m);
    object.t = element.number_in("t", -kMaxRoadLength_m, kMaxRoadLength_m);
    object.z_offset = element.number("zOffset", 0);
    object.heading = element.number("hdg", 0);
    object.length = element.number("length", 0);
    object.width = element.number("width", 0);
    Element outline = element.child("outline");
    if (!outline) {
      if (const Element outlines = element.child("outlines")) outline = outlines.child("outline");
    }
    if (outline) {
      outline.each_child([&](const Element& corner) {
        if (corner.name() == "cornerLocal") {
          object.outline.push_back({corner.number("u"), corner.number("v"), corner.number("z", 0), false});
        } else if (corner.name() == "cornerRoad") {
          object.outline.push_back({corner.number("s"), corner.number("t"), corner.number("dz", 0), true});
        }
      });
    }
    road->objects.push_back(std::move(object));
  });
}

void read_signals(const Element& road_element, FileRoad* road) {
  const Element signals = road_element.child("signals");
  if (!signals) return;
  signals.each("signal", [&](const Element& element) {
    FileSignal signal;
    signal.where = element.where();
    signal.id = element.text("id");
    signal.type = element.text("type", "");
    signal.s = element.number_in("s", -kMaxRoadLength_m, kMaxRoadLength_m);
    signal.t = element.number_in("t", -kMaxRoadLength_m, kMaxRoadLength_m);
    signal.z_offset = element.number("zOffset", 0);
    road->signals.push_back(std::move(signal));
  });
  signals.each("signalReference", [&](const Element& element) {
    SignalReference reference;
    reference.where = element.where();
    reference.signal = element.text("id");
    reference.s = element.number_in("s", -kMaxRoadLength_m, kMaxRoadLength_m);
    bool any = false;
    element.each("validity", [&](const Element& validity) {
      reference.from_lane = validity.integer("fromLane");
      reference.to_lane = validity.integer("toLane");
      road->signal_references.push_back(reference);
      any = true;
    });
    if (!any) road->signal_references.push_back(reference);
  });
}

/// Every geometry begins where and when the one before it ends, and together they are as long as the road.
void check_geometry(const std::vector<Element>& elements, const FileRoad& road) {
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const GeometryPiece& piece = road.geometry[i];
    if (i == 0) {
      if (piece.s > kStationTolerance_m) elements[i].fail("attribute s: expected 0 for the first one, got {}", piece.s);
      continue;
    }
    const GeometryPiece& before = road.geometry[i - 1];
    if (std::abs(piece.s - (before.s + before.length)) > kStationTolerance_m) {
      elements[i].fail("attribute s: expected {}, where the one before it ends, got {}", before.s + before.length,
                       piece.s);
    }
    const Pose end = pose_on(before, before.length);
    const double gap_m = std::hypot(piece.x - end.x, piece.y - end.y);
    if (gap_m > kMaxGap_m) {
      elements[i].fail("begins {:.3f} m from the end of the one before it, at ({}, {}); expected at most {} m", gap_m,
                       end.x, end.y, kMaxGap_m);
    }
  }
  const GeometryPiece& last = road.geometry.back();
  if (std::abs(last.s + last.length - road.length) > kMaxGap_m) {
    elements.back().fail("the reference line ends at {}; expected the road's length, {}", last.s + last.length,
                         road.length);
  }
}

void refuse_superelevation(const Element& road_element) {
  const Element lateral = road_element.child("lateralProfile");
  if (!lateral) return;
  for (const char* name : {"superelevation", "shape"}) {
    lateral.each(name, [&](const Element& element) {
      for (const char* coefficient : {"a", "b", "c", "d"}) {
        if (std::abs(element.number(coefficient, 0)) > 1e-9) element.fail("banked roads are not supported");
      }
    });
  }
}

FileRoad read_road(const Element& element) {
  FileRoad road;
  road.where = element.where();
  road.id = element.text("id");
  road.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (road.length == 0) element.fail("attribute length: expected more than 0");
  const std::string junction = element.text("junction", "-1");
  if (junction != "-1") road.junction = junction;
  if (element.text("rule", "RHT") != "RHT") element.fail("attribute rule: only right-hand traffic (RHT) is supported");
  if (const Element link = element.child("link")) {
    road.predecessor = read_road_link(link.child("predecessor"));
    road.successor = read_road_link(link.child("successor"));
  }
  element.each("type", [&](const Element& type) {
    const Element speed = type.child("speed");
    road.speed_limit_mps.cubics.push_back(
        {.s = type.number_in("s", 0, road.length), .a = speed ? speed_mps(speed) : 0});
  });
  std::vector<Element> geometry;
  element.needed_child("planView").each("geometry", [&](const Element& piece) {
    geometry.push_back(piece);
    road.geometry.push_back(read_geometry(piece));
  });
  if (geometry.empty()) element.child("planView").fail("expected a <geometry> in it, found none");
  check_geometry(geometry, road);
  road.elevation = read_profile(element.child("elevationProfile"), "elevation", "s", road.length);
  refuse_superelevation(element);
  read_lanes(element, &road);
  read_objects(element, &road);
  read_signals(element, &road);
  return road;
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

}  // namespace

void read_network(std::string_view text, const std::string& source_name, Network* network_out) {
  Network& network = *network_out;
  network = Network();
  network.source = {source_name, text};
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
  root.each("controller", [&](const Element& element) {
    FileController controller;
    controller.id = element.text("id");
    controller.where = element.with_owner(fmt::format("controller {}", controller.id)).where();
    controller.sequence = element.has("sequence") ? element.integer("sequence") : 0;
    element.each("control", [&](const Element& control) { controller.signals.push_back(control.text("signalId")); });
    network.controllers.push_back(std::move(controller));
  });
}

}  // namespace pictura::opendrive
