// What an OpenDRIVE file says, as plain structs in the file's own terms: s and t along reference lines, lane ids,
// signal ids. The reader fills them and checks every attribute; the builders turn them into a RoadMap.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/map/road_map.h"

namespace pictura::opendrive {

/// The file's name and text; turns an element's byte offset into a line, counted from 1.
class Source {
 public:
  Source() = default;
  Source(std::string name, std::string_view text);

  const std::string& name() const { return name_; }
  int32_t line_at(std::ptrdiff_t offset) const;

 private:
  std::string name_;
  std::vector<std::ptrdiff_t> line_ends_;
};

/// Where an element stands: its byte offset in the text and what it belongs to ("road 12", "junction 3").
struct Where {
  const Source* source = nullptr;
  std::ptrdiff_t offset = 0;
  std::string owner;
  const char* element = "";

  int32_t line() const { return source ? source->line_at(offset) : 0; }

  /// Throws Error "SOURCE:LINE: OWNER: <element>: message".
  [[noreturn]] void fail_with(const std::string& message) const;

  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    fail_with(fmt::format(format, std::forward<Args>(args)...));
  }
};

/// a + b ds + c ds^2 + d ds^3 from s on, ds = s' - s.
struct Cubic {
  double s = 0, a = 0, b = 0, c = 0, d = 0;
};

/// A function of s made of cubics, in ascending order of s; 0 before the first.
struct Profile {
  std::vector<Cubic> cubics;

  double value(double s) const;
  double slope(double s) const;
};

/// A piece of a reference line: curvature falls linearly from one end to the other (line: 0 and 0, arc: equal).
struct GeometryPiece {
  double s = 0, x = 0, y = 0, heading = 0, length = 0;
  double start_curvature = 0, end_curvature = 0;
};

struct RoadMark {
  double s_offset = 0;
  std::string type;  // "none", "solid", "broken solid", ...
  MarkColor color = MarkColor::white;
  double width = 0;  // 0: the file gives none
};

struct FileLane {
  int id = 0;  // positive left of the reference line, negative right, 0 the line itself
  std::string type_name;
  LaneType type = LaneType::other;
  bool is_void = false;  // type "none": no surface
  std::optional<int> predecessor, successor;
  Profile width;                // of s - section s
  std::vector<RoadMark> marks;  // on its outer border, in ascending order of s_offset
  Where where;
};

struct FileSection {
  double s = 0, end = 0;
  FileLane center;
  std::vector<FileLane> left, right;  // outwards: ids 1, 2, ... and -1, -2, ...

  const FileLane* lane(int id) const;
};

enum class ContactPoint : uint8_t { start, end };

/// The end of a road that another one meets.
struct RoadLink {
  enum class Kind : uint8_t { none, road, junction } kind = Kind::none;
  std::string id;
  ContactPoint contact = ContactPoint::start;
  Where where;
};

struct FileSignal {
  std::string id, type;
  double s = 0, t = 0, z_offset = 0;
  Where where;
};

/// Says that a signal holds for lanes [from_lane, to_lane] of the road on which the reference stands.
struct SignalReference {
  std::string signal;
  double s = 0;
  int from_lane = 0, to_lane = 0;  // 0, 0: the file names none
  Where where;
};

/// Corners are (u, v) in the object's frame, or (s, t) along the road.
struct FileObject {
  std::string type;
  double s = 0, t = 0, z_offset = 0, heading = 0, length = 0, width = 0;
  struct Corner {
    double u = 0, v = 0, z = 0;
    bool along_road = false;
  };
  std::vector<Corner> outline;
  Where where;
};

struct FileRoad {
  std::string id, junction;  // junction is empty when the road is none's
  double length = 0;
  RoadLink predecessor, successor;
  Profile speed_limit_mps;  // constants; 0 where the file gives none
  std::vector<GeometryPiece> geometry;
  Profile elevation, lane_offset;
  std::vector<FileSection> sections;
  std::vector<FileObject> objects;
  std::vector<FileSignal> signals;
  std::vector<SignalReference> signal_references;
  Where where;

  double speed_limit_at(double s) const { return speed_limit_mps.value(s); }
};

struct LaneLink {
  int from = 0, to = 0;
};

struct Connection {
  std::string incoming_road, connecting_road;
  ContactPoint contact = ContactPoint::start;  // the end of the connecting road that meets the incoming one
  std::vector<LaneLink> lane_links;
  Where where;
};

struct FileJunction {
  std::string id;
  std::vector<Connection> connections;
  std::vector<std::string> controllers;
  Where where;
};

struct FileController {
  std::string id;
  int sequence = 0;
  std::vector<std::string> signals;
  Where where;
};

struct Network {
  Source source;
  std::vector<FileRoad> roads;
  std::vector<FileJunction> junctions;
  std::vector<FileController> controllers;
  std::unordered_map<std::string, int> road_index, junction_index;
};

}  // namespace pictura::opendrive
