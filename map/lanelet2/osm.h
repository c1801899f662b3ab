// The contents of a Lanelet2 file: its points, lines and relations as OpenStreetMap's XML has them, with checked ids
// and numbers and resolved references. Indices are into the vectors of the same OsmFile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <pugixml.hpp>

#include "pictura/common/error_types.h"
#include "pictura/map/lanelet2/projection.h"
#include "pictura/map/opendrive/model.h"
#include "pictura/map/plan_map.h"

namespace pictura::lanelet2 {

/// What Lanelet2 reads as true and as false; nothing for everything else.
std::optional<bool> flag_of(std::string_view value);

/// Keys and values, in the file's order. Refers to the document.
class Tags {
 public:
  void add(std::string_view key, std::string_view value) { tags_.emplace_back(key, value); }
  /// The value of the first tag with that key; empty where there is none.
  std::string_view of(std::string_view key) const;
  bool has(std::string_view key) const { return !of(key).empty(); }
  std::optional<bool> flag(std::string_view key) const { return flag_of(of(key)); }
  auto begin() const { return tags_.begin(); }
  auto end() const { return tags_.end(); }

 private:
  std::vector<std::pair<std::string_view, std::string_view>> tags_;
};

enum class DashMark : uint8_t { none, begin, end };

struct Node {
  int64_t id = 0;
  std::ptrdiff_t offset = 0;
  std::optional<GeoPoint> geo;
  std::optional<GridPoint> local;  // local_x and local_y
  std::string_view mgrs;           // mgrs_code, or empty
  DashMark dash = DashMark::none;
  bool has_position = false;
  Eigen::Vector3d position_m{0, 0, 0};  // in the map's file coordinates; set by place_nodes()
};

struct Way {
  int64_t id = 0;
  std::ptrdiff_t offset = 0;
  Tags tags;
  std::vector<int32_t> nodes;  // at least two, with positions
};

struct Relation {
  int64_t id = 0;
  std::ptrdiff_t offset = 0;
  Tags tags;
  struct Member {
    std::string_view role;
    int32_t way = -1, relation = -1;  // one of them
  };
  std::vector<Member> members;

  /// The ways with that role, in the file's order.
  std::vector<int32_t> ways(std::string_view role) const;
  std::vector<int32_t> relations(std::string_view role) const;
};

struct OsmFile {
  pugi::xml_document document;
  opendrive::Source source;
  std::vector<Node> nodes;
  std::vector<Way> ways;
  std::vector<Relation> relations;
  std::string geo_reference;  // reference of the coordinates, a PROJ string; may be empty

  opendrive::SourceLocation where(const Node& node) const { return place("node", "node", node); }
  opendrive::SourceLocation where(const Way& way) const { return place("way", "way", way); }
  /// Its owner is "lanelet 12" and the like.
  opendrive::SourceLocation where(const Relation& relation) const;

 private:
  template <typename Item>
  opendrive::SourceLocation place(std::string_view owner, const char* element, const Item& item) const {
    return {&source, item.offset, fmt::format("{} {}", owner, item.id), element};
  }
};

/// Reads `text`; `name` names it in messages. Repairs the faults that docs/reference/lanelet2.md lists; throws
/// Error naming file, line and element for all other faults.
void read_osm(std::string_view text, const std::string& name, opendrive::Faults* faults, OsmFile* file_out);

/// Sets the positions of all nodes and the geographic reference, and leaves out nodes without a position: of `origin`
/// the UTM coordinates minus the origin's; else local coordinates, if any node has them; else UTM in the zone of the
/// first node. The plan, of a copy, is applied to the result.
void place_nodes(const std::optional<GeoPoint>& origin, const PlanMap& plan, opendrive::Faults* faults,
                 OsmFile* file_inout);

/// A speed in m/s from text like "50", "50 km/h", "25 mph" or "13.9 m/s"; km/h where there is no unit. Nothing for
/// other text and for what is no speed limit.
std::optional<double> parse_speed_mps(std::string_view text);

}  // namespace pictura::lanelet2
