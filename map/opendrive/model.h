// What an OpenDRIVE file says, as plain structs in the file's own terms: s and t along reference lines, lane ids,
// signal ids. The reader fills them and checks every attribute; the builders turn them into a RoadMap.
#pragma once

#include <array>
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
  std::string owner, element;

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

/// A curve (u(p), v(p)), p from 0 to p_end, in the frame of its start; <poly3> is one with u = p.
struct PlaneCubic {
  std::array<double, 4> u{}, v{};  // coefficients of p^0 to p^3
  double p_end = 0;
  std::array<double, 17> arc_length{};  // from the start to p_end i / 16; see measure() in curves.h
};

/// A piece of a reference line: a cubic, or a curve whose curvature changes linearly from one end to the other (line: 0
/// and 0, arc: equal).
struct GeometryPiece {
  double s = 0, x = 0, y = 0, heading = 0, length = 0;
  double start_curvature = 0, end_curvature = 0;
  std::optional<PlaneCubic> cubic;
  // Of a spiral: where each of its panels begins, as seen from its start along its heading; see measure() in curves.h.
  std::vector<std::array<double, 2>> panels;
};

/// One stripe of a mark, as <line> gives it.
struct MarkLine {
  double length = 0, space = 0;  // of a dash and of the gap behind it; explicit lines have no gap
  double t_offset = 0;           // of its middle, left of the lane's border
  double s_offset = 0;           // where its first dash begins, from the mark's begin
  double width = 0;              // 0: the mark's
  std::optional<MarkColor> color;
};

enum class LaneChange : uint8_t { both, increase, decrease, none };

struct RoadMark {
  double s_offset = 0;  // from the section's s; negative on continued lanes
  std::string type;     // "none", "solid", "broken solid", ...
  bool bold = false;
  MarkColor color = MarkColor::white;
  double width = 0;                           // 0: the file gives none
  LaneChange lane_change = LaneChange::both;  // towards which lane ids one may change over it
  std::vector<MarkLine> lines;                // repeated along the mark; instead of the type's own pattern
  std::vector<MarkLine> explicit_lines;       // painted once each
  Profile sway;                               // moves the lines to the left; of s - the mark's begin
  Where where;
};

/// Whether traffic runs as the road's rule says, against it, or both ways.
enum class LaneDirection : uint8_t { standard, reversed, both };

struct FileLane {
  int id = 0;  // positive left of the reference line, negative right, 0 the line itself
  std::string type_name;
  LaneType type = LaneType::other;
  int section = 0;            // the file's <laneSection> in its road, from 0
  bool is_continued = false;  // the rest of the same <lane>, which stands in an earlier FileSection too
  bool is_void = false;       // type "none": no surface
  bool is_level = false;      // keeps the height of its inner border on banked roads
  LaneDirection direction = LaneDirection::standard;
  std::vector<int> predecessors, successors;
  // Functions of s - the section's s.
  Profile width;
  Profile border;                      // where there is no width: t of the outer border from the reference line
  Profile inner_height, outer_height;  // constants: above the road at the lane's borders
  Profile speed_limit_mps;             // constants; 0 where there is none
  std::vector<RoadMark> marks;         // on its outer border, in ascending order of s_offset
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

/// For which traffic of a road something stands: along s ("+"), against it ("-"), or either.
enum class Orientation : uint8_t { along, against, either };

struct LaneRange {
  int from = 0, to = 0;
};

struct FileSignal {
  std::string id, type, subtype, country, name;
  double s = 0, t = 0, z_offset = 0, heading_offset = 0;
  bool is_dynamic = false;
  Orientation orientation = Orientation::either;
  std::vector<LaneRange> validity;  // empty: every lane of its orientation
  Where where;
};

/// Says that a signal holds for lanes of the road on which the reference stands.
struct SignalReference {
  std::string signal;
  double s = 0, t = 0;
  Orientation orientation = Orientation::either;
  std::vector<LaneRange> validity;  // empty: every lane of its orientation
  Where where;
};

/// Corners are (u, v) in the object's frame, or (s, t) along the road.
struct FileObject {
  enum class Kind : uint8_t { crosswalk, parking_space, stop_line } kind = Kind::crosswalk;
  std::string id, name;
  double s = 0, t = 0, z_offset = 0, heading = 0, length = 0, width = 0;
  struct Corner {
    double u = 0, v = 0, z = 0;
    bool along_road = false;
  };
  std::vector<Corner> outline;
  Where where;
};

/// Heights above the banked road at one s, as a function of t.
struct CrossSection {
  double s = 0;
  Profile height;
};

struct FileRoad {
  std::string id, junction;  // junction is empty when the road is none's
  double length = 0;
  bool left_hand = false;  // traffic keeps left
  RoadLink predecessor, successor;
  Profile speed_limit_mps;  // constants; 0 where the file gives none
  std::vector<GeometryPiece> geometry;
  Profile elevation, lane_offset;
  Profile superelevation;                   // rad, about the reference line, left side up
  Profile left_crossfall, right_crossfall;  // rad, down from the reference line
  std::vector<CrossSection> shape;          // in ascending order of s, linear in between
  std::vector<FileSection> sections;
  std::vector<FileObject> objects;
  std::vector<FileSignal> signals;
  std::vector<SignalReference> signal_references;
  Where where;
};

struct LaneLink {
  int from = 0, to = 0;
  Where where;
};

struct Connection {
  std::string incoming_road, connecting_road;  // direct junctions: the linked road
  ContactPoint contact = ContactPoint::start;  // the end of the connecting road that meets the incoming one
  std::vector<LaneLink> lane_links;
  Where where;
};

struct FileJunction {
  std::string id;
  bool is_direct = false;  // roads meet without roads of the junction's own
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
  std::string geo_reference;
  std::vector<FileRoad> roads;
  std::vector<FileJunction> junctions;
  std::vector<FileController> controllers;
  std::unordered_map<std::string, int> road_index, junction_index;
};

}  // namespace pictura::opendrive
