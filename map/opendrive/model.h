// Contents of an OpenDRIVE file in the file's own terms. The reader checks every attribute, and the build stages turn
// the structs into a RoadMap.
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
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/plan_map.h"
#include "pictura/map/road_map.h"

namespace pictura::opendrive {

/// Name of the file, and the line numbers of byte offsets. The first line is 1.
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

/// Byte offset of an element, and its owner ("road 12", "junction 3").
struct SourceLocation {
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

  /// See Faults::record_repair().
  void record_repair_with(Faults* faults, RepairKind kind, const std::string& message) const;

  template <typename... Args>
  void record_repair(Faults* faults, RepairKind kind, fmt::format_string<Args...> format, Args&&... args) const {
    record_repair_with(faults, kind, fmt::format(format, std::forward<Args>(args)...));
  }
};

/// The cubic a + b ds + c ds^2 + d ds^3, where ds is the distance from s.
struct Cubic {
  double s = 0, a = 0, b = 0, c = 0, d = 0;
};

/// Piecewise cubic function of s; 0 before the first cubic. Cubics are sorted by s.
struct Profile {
  std::vector<Cubic> cubics;

  double value(double s) const;
  double slope(double s) const;
};

/// A parametric cubic (u(p), v(p)) in the frame of its start, for p in [0, p_end]. A <poly3> has u = p.
struct PlaneCubic {
  std::array<double, 4> u{}, v{};  // coefficients of p^0 to p^3
  double p_end = 0;
  std::array<double, 17> arc_length{};  // arc length to p = p_end * i / 16; set by measure()
};

/// A piece of a reference line: a cubic, or a curve whose curvature changes linearly along it.
struct GeometryPiece {
  double s = 0, x = 0, y = 0, heading = 0, length = 0;
  double start_curvature = 0, end_curvature = 0;
  std::optional<PlaneCubic> cubic;
  // Starts of a spiral's integration panels, relative to the piece's start; set by measure().
  std::vector<std::array<double, 2>> panels;
};

/// A <line> of a mark.
struct MarkLine {
  double length = 0, space = 0;  // lengths of a dash and of the gap after it
  double t_offset = 0;           // offset of this line's middle to the left of the lane's border
  double s_offset = 0;           // first dash, from the start of the mark
  double width = 0;              // 0: the mark's width
  std::optional<MarkColor> color;
};

enum class LaneChange : uint8_t { both, increase, decrease, none };

struct RoadMark {
  double s_offset = 0;  // from the section's s; negative on continued lanes
  std::string type;     // "none", "solid", "broken solid", ...
  bool bold = false;
  MarkColor color = MarkColor::white;
  double width = 0;                           // 0: not given
  LaneChange lane_change = LaneChange::both;  // permitted directions of lane changes
  std::vector<MarkLine> lines;                // repeated along the mark, in place of the pattern of `type`
  std::vector<MarkLine> explicit_lines;       // painted once each
  Profile sway;                               // shift to the left, as a function of s minus the mark's start
  SourceLocation where;
};

/// Direction of traffic relative to the road's rule.
enum class LaneDirection : uint8_t { standard, reversed, both };

struct FileLane {
  int id = 0;  // positive on the left of the reference line
  std::string type_name;
  LaneType type = LaneType::other;
  int section = 0;            // index in the file
  bool is_continued = false;  // continues a <lane> of an earlier FileSection
  bool is_void = false;       // type "none": no surface
  bool is_level = false;      // keeps the height of its inner border on banked roads
  LaneDirection direction = LaneDirection::standard;
  std::vector<int> predecessors, successors;
  // Functions of s minus the section's s.
  Profile width;
  Profile border;                      // t of the outer border; used if the lane has no widths
  Profile inner_height, outer_height;  // heights of the borders above the road; piecewise constant
  Profile speed_limit_mps;             // piecewise constant; 0: no limit
  std::vector<RoadMark> marks;         // on the outer border, sorted by s_offset
  SourceLocation where;
};

struct FileSection {
  double s = 0, end = 0;
  FileLane center;
  std::vector<FileLane> left, right;  // from the centre outwards: ids 1, 2, ... and -1, -2, ...
  SourceLocation where;

  const FileLane* lane(int id) const;
};

enum class ContactPoint : uint8_t { start, end };

/// Predecessor or successor of a road.
struct RoadLink {
  enum class Kind : uint8_t { none, road, junction } kind = Kind::none;
  std::string id;
  ContactPoint contact = ContactPoint::start;
  bool has_contact = true;  // false: missing in the file and determined by repair_links()
  SourceLocation where;     // also set if repair_links() cleared the link
};

/// Direction of the traffic to which a signal applies: along s ("+"), against s ("-"), or either.
enum class Orientation : uint8_t { along, against, either };

struct LaneRange {
  int from = 0, to = 0;
};

struct FileSignal {
  std::string id, type, subtype, country, name;
  double s = 0, t = 0, z_offset = 0, heading_offset = 0;
  bool is_dynamic = false;
  Orientation orientation = Orientation::either;
  std::vector<LaneRange> validity;  // empty: all lanes of this orientation
  std::optional<double> stop_s;     // stop line of a light away from junctions; set by split_at_lights()
  SourceLocation where;
};

/// Reference to a signal of any road. The signal applies to lanes of the road that contains the reference.
struct SignalReference {
  std::string signal;
  double s = 0, t = 0;
  Orientation orientation = Orientation::either;
  std::vector<LaneRange> validity;
  std::optional<double> stop_s;
  SourceLocation where;
};

/// Corners are (u, v) in the object's frame, or (s, t) of the road if along_road is set.
struct FileObject {
  enum class Kind : uint8_t { crosswalk, parking_space, stop_line } kind = Kind::crosswalk;
  std::string id, name;
  double s = 0, t = 0, z_offset = 0, heading = 0, length = 0, width = 0;
  struct Corner {
    double u = 0, v = 0, z = 0;
    bool along_road = false;
  };
  std::vector<Corner> outline;
  SourceLocation where;
};

/// Height above the banked road as a function of t.
struct CrossSection {
  double s = 0;
  Profile height;
};

/// Deformation of a road in an affine copy (deform.h). The shift is a smoothstep of s, so headings at the ends do not
/// change.
struct RoadDeformation {
  PlanMap plan;
  std::array<double, 2> start_shift_m{}, end_shift_m{};
};

struct FileRoad {
  std::string id, junction;  // `junction` is empty outside junctions
  double length = 0;
  bool left_hand = false;
  RoadLink predecessor, successor;
  Profile speed_limit_mps;  // piecewise constant; 0: no limit
  std::vector<GeometryPiece> geometry;
  std::optional<RoadDeformation> deformation;  // if set, s is not an arc length
  Profile elevation, lane_offset;
  Profile superelevation;                   // rad; positive: left side up
  Profile left_crossfall, right_crossfall;  // rad; positive: down from the reference line
  std::vector<CrossSection> shape;          // sorted by s; heights between them are interpolated
  std::vector<FileSection> sections;
  std::size_t num_copied_records = 0;  // see continue_lanes()
  std::vector<FileObject> objects;
  std::vector<FileSignal> signals;
  std::vector<SignalReference> signal_references;
  SourceLocation where;
};

struct LaneLink {
  int from = 0, to = 0;
  SourceLocation where;
};

struct Connection {
  std::string incoming_road, connecting_road;       // in direct junctions, connecting_road is the linked road
  ContactPoint contact = ContactPoint::start;       // end of the connecting road at the incoming road
  bool has_contact = true;                          // see RoadLink
  ContactPoint incoming_end = ContactPoint::start;  // end of the incoming road at the junction; set by repair_links()
  std::vector<LaneLink> lane_links;
  SourceLocation where;
};

struct FileJunction {
  std::string id;
  bool is_direct = false;  // has no connecting roads
  std::vector<Connection> connections;
  std::vector<std::string> controllers;
  SourceLocation where;
};

struct FileController {
  std::string id;
  int sequence = 0;
  std::vector<std::string> signals;
  SourceLocation where;
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
