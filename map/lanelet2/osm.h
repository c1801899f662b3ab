// Contents of a Lanelet2 file: nodes (points), ways (lines) and relations, as in OpenStreetMap's XML. Ids and numbers
// are checked, and references are resolved. Indices refer to the vectors of the same OsmFile.
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

/// Returns true for texts that Lanelet2 reads as true, false for texts that it reads as false, and nullopt for all
/// others.
std::optional<bool> flag_of(std::string_view value);

/// Keys and values of an element, in the order of the file. Tags point into the document, which must outlive them.
class Tags {
 public:
  void add(std::string_view key, std::string_view value) { tags_.emplace_back(key, value); }
  /// Returns the value of the first tag with that key; empty if no tag has it.
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
  std::optional<GridPoint> local;  // tags local_x and local_y
  std::string_view mgrs;           // tag mgrs_code, or empty
  DashMark dash = DashMark::none;
  bool has_position = false;
  Eigen::Vector3d position_m{0, 0, 0};  // in the map's file coordinates; set by place_nodes()
};

struct Way {
  int64_t id = 0;
  std::ptrdiff_t offset = 0;
  Tags tags;
  std::vector<int32_t> nodes;  // at least two nodes, all with positions
};

struct Relation {
  int64_t id = 0;
  std::ptrdiff_t offset = 0;
  Tags tags;
  struct Member {
    std::string_view role;
    int32_t way = -1, relation = -1;  // one of the two; the other is -1
  };
  std::vector<Member> members;

  /// Returns the ways with that role, in the order of the file.
  std::vector<int32_t> ways(std::string_view role) const;
  std::vector<int32_t> relations(std::string_view role) const;
};

struct OsmFile {
  pugi::xml_document document;
  opendrive::Source source;
  std::vector<Node> nodes;
  std::vector<Way> ways;
  std::vector<Relation> relations;
  std::string geo_reference;  // geographic reference of the coordinates, a PROJ string; may be empty

  opendrive::SourceLocation where(const Node& node) const { return place("node", "node", node); }
  opendrive::SourceLocation where(const Way& way) const { return place("way", "way", way); }
  /// Returns a location whose owner is the relation's kind and id, such as "lanelet 12".
  opendrive::SourceLocation where(const Relation& relation) const;

 private:
  template <typename Item>
  opendrive::SourceLocation place(std::string_view owner, const char* element, const Item& item) const {
    return {&source, item.offset, fmt::format("{} {}", owner, item.id), element};
  }
};

/// Reads `text`. `name` is the file's name in messages. Repairs the faults that docs/reference/lanelet2.md lists.
/// Throws Error, which names file, line and element, for all other faults.
void read_osm(std::string_view text, const std::string& name, opendrive::Faults* faults, OsmFile* file_out);

/// Sets the positions of all nodes and the geographic reference, and removes nodes without a position from ways. With
/// `origin`, positions are UTM coordinates minus those of the origin. Without it, positions are local coordinates if
/// any node has them, else UTM coordinates in the zone of the first node. Finally, transforms the positions by `plan`,
/// which makes an affine copy of a map (map/plan_map.h).
void place_nodes(const std::optional<GeoPoint>& origin, const PlanMap& plan, opendrive::Faults* faults,
                 OsmFile* file_inout);

/// Parses a speed limit like "50", "50 km/h", "25 mph" or "13.9 m/s", and returns it in m/s. A number without a unit is
/// in km/h. Returns nullopt for other texts, and for speeds that cannot be a limit.
std::optional<double> parse_speed_mps(std::string_view text);

}  // namespace pictura::lanelet2
