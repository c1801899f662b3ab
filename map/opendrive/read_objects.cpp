// Reads objects (crosswalks, parking spaces, stop lines), signals and signal references.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

// Maximum distance of objects before the start or after the end of their road.
constexpr double kMaxOverhang_m = 10;
// Minimum distance between the copies of a <repeat>. A smaller distance means one continuous object.
constexpr double kMinRepeat_m = 0.1;
constexpr std::size_t kMaxCopies = 10'000;
constexpr std::size_t kMaxCopiedCorners = 1'000'000;
constexpr double kMaxSize_m = 1e3;

bool contains_word(std::string text, std::string_view word) {
  std::erase_if(text, [](unsigned char c) { return std::isalnum(c) == 0; });
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text.find(word) != std::string::npos;
}

/// Returns the kind of an object if RoadMap stores such objects, else nullopt. OpenDRIVE has no object type for stop
/// lines. Files contain them as road marks of the subtype signalLines, or as objects with the name stop line.
std::optional<FileObject::Kind> kind_of(const Element& element) {
  const std::string type = element.text("type", "none");
  if (type == "crosswalk") return FileObject::Kind::crosswalk;
  if (type == "parking" || type == "parkingSpace") return FileObject::Kind::parking_space;
  if (type == "roadMark" && element.text("subtype", "") == "signalLines") return FileObject::Kind::stop_line;
  if (contains_word(type, "stopline") || contains_word(element.text("subtype", ""), "stopline") ||
      contains_word(element.text("name", ""), "stopline")) {
    return FileObject::Kind::stop_line;
  }
  return std::nullopt;
}

/// Whether an object or signal is beside its road. If not, records the repair: the caller omits it.
bool is_near_road(const Element& element, double road_length) {
  const double low_s = -kMaxOverhang_m, high_s = road_length + kMaxOverhang_m;
  const double s = element.number("s"), t = element.number_or_zero("t");
  if (!(s >= low_s && s <= high_s)) {
    element.record_repair(RepairKind::misplaced_item, "attribute s: expected a number in [{}, {}], got {}", low_s,
                          high_s, s);
    return false;
  }
  if (!(std::abs(t) <= kMaxOffset_m)) {
    element.record_repair(RepairKind::misplaced_item, "attribute t: expected a number in [{}, {}], got {}",
                          -kMaxOffset_m, kMaxOffset_m, t);
    return false;
  }
  return true;
}

double read_offset(const Element& element, const char* attribute) {
  return element.number_in(attribute, -kMaxOffset_m, kMaxOffset_m);
}

double read_height(const Element& element, const char* attribute) {
  return element.number_in(attribute, -kMaxHeight_m, kMaxHeight_m, 0);
}

/// Returns the outer outline of an object. Its other outlines are holes in the object or parts of it.
Element outer_outline(const Element& element) {
  Element outline = element.child("outline");
  if (const Element outlines = element.child("outlines"); !outline && outlines) {
    outlines.each("outline", [&](const Element& candidate) {
      if (!outline || (candidate.flag("outer") && !outline.flag("outer"))) outline = candidate;
    });
  }
  return outline;
}

/// Reads an outline. Returns nullopt if a corner is far from the road.
std::optional<std::vector<FileObject::Corner>> read_outline(const Element& element, double road_length) {
  std::vector<FileObject::Corner> corners;
  bool is_near = true;
  if (const Element outline = outer_outline(element)) {
    outline.each_child([&](const Element& corner) {
      if (corner.name() == "cornerLocal") {
        corners.push_back({read_offset(corner, "u"), read_offset(corner, "v"), read_height(corner, "z"), false});
      } else if (corner.name() == "cornerRoad" && (is_near = is_near && is_near_road(corner, road_length))) {
        corners.push_back({corner.number("s"), corner.number("t", 0), read_height(corner, "dz"), true});
      }
    });
  }
  if (!is_near) return std::nullopt;
  return corners;
}

/// Reads an object. Returns nullopt if the object is far from its road.
std::optional<FileObject> read_object(const Element& element, FileObject::Kind kind, double road_length) {
  FileObject object;
  object.where = element.where();
  object.kind = kind;
  object.id = element.text("id", "");
  object.name = element.text("name", "");
  if (!is_near_road(element, road_length)) return std::nullopt;
  object.s = element.number("s");
  object.t = element.number("t", 0);
  object.z_offset = read_height(element, "zOffset");
  object.heading = element.number_in("hdg", -1e3, 1e3, 0);
  object.length = element.size("length", kMaxSize_m);
  object.width = element.size("width", kMaxSize_m);
  std::optional<std::vector<FileObject::Corner>> outline = read_outline(element, road_length);
  if (!outline) return std::nullopt;
  object.outline = std::move(*outline);
  return object;
}

/// Whether the copies of a <repeat> can be made. If not, records the repair: the caller places the object once.
bool can_repeat(const Element& repeat, const FileObject& object) {
  const double distance = repeat.number_in("distance", 0, kMaxRoadLength_m);
  if (distance < kMinRepeat_m) {
    repeat.record_repair(RepairKind::continuous_object,
                         "attribute distance: expected at least {} m (continuous objects are not supported), got {}",
                         kMinRepeat_m, distance);
    return false;
  }
  if (std::any_of(object.outline.begin(), object.outline.end(), [](const auto& c) { return c.along_road; })) {
    repeat.record_repair(RepairKind::repeated_corners, "objects with <cornerRoad> cannot be repeated");
    return false;
  }
  return true;
}

/// Returns the object itself, or its copies along each <repeat> element, with linearly interpolated attributes.
std::vector<FileObject> repeated(const Element& element, const FileObject& object, double road_length) {
  std::vector<FileObject> copies;
  element.each("repeat", [&](const Element& repeat) {
    if (!can_repeat(repeat, object)) return;
    const std::optional<double> station = read_station(repeat, "s", road_length);
    if (!station) return;
    const double begin = std::max(*station, 0.0), distance = repeat.number("distance");
    double length = repeat.number_in("length", 0, kMaxRoadLength_m);
    if (length > road_length + kMaxOverhang_m) {
      repeat.record_repair(RepairKind::record_beyond_end, "attribute length: expected a number in [0, {}], got {}",
                           road_length + kMaxOverhang_m, length);
      length = road_length - begin;
    }
    auto between = [&](const char* start, const char* end, double fallback, double u) {
      const double a = repeat.number_in(start, -kMaxOffset_m, kMaxOffset_m, fallback);
      return a + u * (repeat.number_in(end, -kMaxOffset_m, kMaxOffset_m, a) - a);
    };
    for (int i = 0; i * distance <= length + kStationTolerance_m; ++i) {
      const double u = length > 0 ? std::min(1.0, i * distance / length) : 0;
      FileObject copy = object;
      copy.s = std::min(begin + i * distance, road_length);
      copy.t = between("tStart", "tEnd", object.t, u);
      copy.z_offset = between("zOffsetStart", "zOffsetEnd", object.z_offset, u);
      copy.width = between("widthStart", "widthEnd", object.width, u);
      copy.length = between("lengthStart", "lengthEnd", object.length, u);
      copies.push_back(std::move(copy));
      if (copies.size() > kMaxCopies) repeat.fail("expected at most {} copies of an object", kMaxCopies);
      if (copies.size() * object.outline.size() > kMaxCopiedCorners) {
        repeat.fail("expected copies with at most {} corners in all", kMaxCopiedCorners);
      }
    }
  });
  if (copies.empty()) copies.push_back(object);
  return copies;
}

Orientation read_orientation(const Element& element) {
  const std::string text = element.text("orientation", "none");
  if (text == "+") return Orientation::along;
  if (text == "-") return Orientation::against;
  if (text != "none") {
    element.record_repair(RepairKind::unknown_orientation, "attribute orientation: expected +, - or none, got '{}'",
                          text);
  }
  return Orientation::either;
}

std::vector<LaneRange> read_validity(const Element& element) {
  std::vector<LaneRange> ranges;
  element.each("validity", [&](const Element& validity) {
    ranges.push_back({validity.integer("fromLane"), validity.integer("toLane")});
  });
  return ranges;
}

FileSignal read_signal(const Element& element) {
  FileSignal signal;
  signal.where = element.where();
  signal.id = element.text("id");
  signal.type = element.text("type", "");
  signal.subtype = element.text("subtype", "");
  signal.country = element.text("country", "");
  signal.name = element.text("name", "");
  signal.is_dynamic = element.text("dynamic", "no") == "yes";
  signal.s = element.number("s");
  signal.t = element.number("t", 0);
  signal.z_offset = read_height(element, "zOffset");
  signal.heading_offset = element.number_in("hOffset", -1e3, 1e3, 0);
  signal.orientation = read_orientation(element);
  signal.validity = read_validity(element);
  return signal;
}

}  // namespace

void read_objects(const Element& road_element, FileRoad* road) {
  const Element objects = road_element.child("objects");
  if (!objects) return;
  objects.each("object", [&](const Element& element) {
    const std::optional<FileObject::Kind> kind = kind_of(element);
    if (!kind) return;
    const std::optional<FileObject> object = read_object(element, *kind, road->length);
    if (!object) return;
    for (FileObject& copy : repeated(element, *object, road->length)) road->objects.push_back(std::move(copy));
  });
}

void read_signals(const Element& road_element, FileRoad* road) {
  const Element signals = road_element.child("signals");
  if (!signals) return;
  signals.each("signal", [&](const Element& element) {
    if (is_near_road(element, road->length)) road->signals.push_back(read_signal(element));
  });
  signals.each("signalReference", [&](const Element& element) {
    if (!is_near_road(element, road->length)) return;
    road->signal_references.push_back({element.text("id"), element.number("s"), element.number("t", 0),
                                       read_orientation(element), read_validity(element), std::nullopt,
                                       element.where()});
  });
}

}  // namespace pictura::opendrive
