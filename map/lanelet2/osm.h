// Contents of a Lanelet2 file, as in OpenStreetMap's XML. Indices refer to the vectors of the same OsmFile.
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

/// Returns true for "yes", "true" and "1", false for "no", "false" and "0", and nullopt for other texts.
std::optional<bool> flag_of(std::string_view value);

/// Tags of an element, in the order of the file. The document must outlive them.
class Tags {
 public:
  void add(std::string_view key, std::string_view value) { tags_.emplace_back(key, value); }
  /// Returns the first tag's value, or an empty text.
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
  Eigen::Vector3d position_m{0, 0, 0};  // file coordinates of the map; set by place_nodes()
};

struct Way {
  int64_t id = 0;
  std::ptrdiff_t offset = 0;
  Tags tags;
  std::vector<int32_t> nodes;  // at least two, all with positions
};

struct Relation {
  int64_t id = 0;
  std::ptrdiff_t offset = 0;
  Tags tags;
  struct Member {
    std::string_view role;
    int32_t way = -1, relation = -1;  // the unused one is -1
  };
  std::vector<Member> members;

  /// Returns ways in the order of the file.
  std::vector<int32_t> ways(std::string_view role) const;
  std::vector<int32_t> relations(std::string_view role) const;
};

struct OsmFile {
  pugi::xml_document document;
  opendrive::Source source;
  std::vector<Node> nodes;
  std::vector<Way> ways;
  std::vector<Relation> relations;
  std::string geo_reference;  // PROJ string; may be empty

  opendrive::SourceLocation where(const Node& node) const { return place("node", "node", node); }
  opendrive::SourceLocation where(const Way& way) const { return place("way", "way", way); }
  /// The owner is the relation's kind and id, such as "lanelet 12".
  opendrive::SourceLocation where(const Relation& relation) const;

 private:
  template <typename Item>
  opendrive::SourceLocation place(std::string_view owner, const char* element, const Item& item) const {
    return {&source, item.offset, fmt::format("{} {}", owner, item.id), element};
  }
};

/// `name` is the file's name in messages. Repairs the faults that docs/reference/lanelet2.md lists. Throws Error, which
/// names file, line and element, for other faults.
void read_osm(std::string_view text, const std::string& name, opendrive::Faults* faults, OsmFile* file_out);

/// Sets positions and the geographic reference, and removes nodes without a position from ways. Positions are UTM
/// coordinates minus those of `origin`. Without `origin`, they are the local coordinates if any node has them, else UTM
/// coordinates in the first node's zone. `plan` then transforms the positions.
void place_nodes(const std::optional<GeoPoint>& origin, const PlanMap& plan, opendrive::Faults* faults,
                 OsmFile* file_inout);

/// Parses a speed limit like "50", "50 km/h", "25 mph" or "13.9 m/s". The default unit is km/h. Returns nullopt for
/// other texts and implausible speeds.
std::optional<double> parse_speed_mps(std::string_view text);

}  // namespace pictura::lanelet2
