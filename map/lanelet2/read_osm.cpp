// Reads OpenStreetMap's XML: first nodes, then ways, then relations, whatever their order in the file.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "pictura/common/error.h"
#include "pictura/common/support/numbers.h"
#include "pictura/map/lanelet2/osm.h"
#include "pictura/map/opendrive/document.h"

namespace pictura::lanelet2 {

namespace {

constexpr double kMaxLocal_m = 1e8;  // maximum magnitude of coordinates of any projection

bool is_deleted(pugi::xml_node element) { return std::string_view(element.attribute("action").value()) == "delete"; }

/// Returns the kind of a relation for messages.
std::string_view kind_of(const Tags& tags) {
  const std::string_view type = tags.of("type");
  if (type == "multipolygon") return "area";
  return type.empty() ? "relation" : type;
}

class Reader {
 public:
  Reader(opendrive::Faults* faults, OsmFile* file) : faults_(faults), file_(*file) {}

  void run() {
    const pugi::xml_node root = file_.document.document_element();
    if (std::string_view(root.name()) != "osm") {
      fail("{}: expected a Lanelet2 map, an XML file whose root is <osm>, got <{}>", file_.source.name(), root.name());
    }
    for (const pugi::xml_node element : root.children("node")) {
      if (!is_deleted(element)) read_node(element);
    }
    for (const pugi::xml_node element : root.children("way")) {
      if (!is_deleted(element)) read_way(element);
    }
    // Relations may refer to later relations, so members are read after all relations.
    for (const pugi::xml_node element : root.children("relation")) {
      if (is_deleted(element)) continue;
      Relation relation{.id = id_of(element), .offset = element.offset_debug(), .tags = tags_of(element)};
      if (add_id(relation, &relation_of_id_, file_.relations.size())) file_.relations.push_back(std::move(relation));
    }
    std::size_t next = 0;
    for (const pugi::xml_node element : root.children("relation")) {
      if (next < file_.relations.size() && file_.relations[next].offset == element.offset_debug()) {
        read_members(element, &file_.relations[next++]);
      }
    }
  }

 private:
  using Index = std::unordered_map<int64_t, int32_t>;

  [[noreturn]] void fail_at(pugi::xml_node element, const std::string& message) const {
    fail("{}:{}: <{}>: {}", file_.source.name(), file_.source.line_at(element.offset_debug()), element.name(), message);
  }

  int64_t integer(pugi::xml_node element, const char* attribute) const {
    const char* text = element.attribute(attribute).value();
    const std::optional<int64_t> value = parse_integer(text);
    if (!value) fail_at(element, fmt::format("attribute {}: expected a whole number, got '{}'", attribute, text));
    return *value;
  }
  int64_t id_of(pugi::xml_node element) const { return integer(element, "id"); }

  static Tags tags_of(pugi::xml_node element) {
    Tags tags;
    for (const pugi::xml_node tag : element.children("tag")) {
      tags.add(tag.attribute("k").value(), tag.attribute("v").value());
    }
    return tags;
  }

  /// Returns false if another element of the same kind has the id.
  template <typename Item>
  bool add_id(const Item& item, Index* index, std::size_t at) {
    if (index->emplace(item.id, static_cast<int32_t>(at)).second) return true;
    file_.where(item).record_repair(faults_, RepairKind::repeated_element, "attribute id: another one has it already");
    return false;
  }

  /// Parses a number; returns nullopt for an empty text.
  std::optional<double> number(pugi::xml_node element, std::string_view what, std::string_view text, double limit) {
    if (text.empty()) return std::nullopt;
    const std::optional<double> value = parse_written_number(text);
    if (!value || !(std::abs(*value) <= limit)) {
      fail_at(element, fmt::format("{}: expected a number of at most {} in size, got '{}'", what, limit, text));
    }
    return value;
  }

  void read_node(pugi::xml_node element) {
    Node node{.id = id_of(element), .offset = element.offset_debug()};
    const Tags tags = tags_of(element);
    const std::optional<double> lat = number(element, "attribute lat", element.attribute("lat").value(), 90);
    const std::optional<double> lon = number(element, "attribute lon", element.attribute("lon").value(), 360);
    const std::optional<double> x = number(element, "tag local_x", tags.of("local_x"), kMaxLocal_m);
    const std::optional<double> y = number(element, "tag local_y", tags.of("local_y"), kMaxLocal_m);
    if (lat && lon) node.geo = GeoPoint{*lat, *lon};
    if (x && y) node.local = GridPoint{*x, *y};
    node.mgrs = tags.of("mgrs_code");
    node.position_m.z() = number(element, "tag ele", tags.of("ele"), 1e5).value_or(0);
    const std::string_view type = tags.of("type");
    node.dash = type == "begin" || type == "start" ? DashMark::begin : type == "end" ? DashMark::end : DashMark::none;
    if (add_id(node, &node_of_id_, file_.nodes.size())) file_.nodes.push_back(node);
  }

  void read_way(pugi::xml_node element) {
    Way way{.id = id_of(element), .offset = element.offset_debug(), .tags = tags_of(element)};
    for (const pugi::xml_node reference : element.children("nd")) {
      const int64_t id = integer(reference, "ref");
      const auto found = node_of_id_.find(id);
      if (found == node_of_id_.end()) {
        file_.where(way).record_repair(faults_, RepairKind::missing_element, "refers to node {}, which does not exist",
                                       id);
      } else {
        way.nodes.push_back(found->second);
      }
    }
    if (add_id(way, &way_of_id_, file_.ways.size())) file_.ways.push_back(std::move(way));
  }

  void read_members(pugi::xml_node element, Relation* relation) {
    for (const pugi::xml_node reference : element.children("member")) {
      const int64_t id = integer(reference, "ref");
      const std::string_view type = reference.attribute("type").value(), role = reference.attribute("role").value();
      const bool is_way = type == "way";
      if (!is_way && type != "relation") continue;  // roles of member nodes are not used
      const Index& index = is_way ? way_of_id_ : relation_of_id_;
      const auto found = index.find(id);
      if (found == index.end()) {
        file_.where(*relation).record_repair(faults_, RepairKind::missing_element,
                                             "refers to {} {} as {}, which does not exist", type, id, role);
        continue;
      }
      Relation::Member member{.role = role};
      (is_way ? member.way : member.relation) = found->second;
      relation->members.push_back(member);
    }
  }

  opendrive::Faults* faults_;
  OsmFile& file_;
  Index node_of_id_, way_of_id_, relation_of_id_;
};

/// Determines the coordinates of a file's nodes from the kinds of coordinates that the nodes have.
class Placement {
 public:
  Placement(const std::optional<GeoPoint>& origin, OsmFile* file) : file_(*file) {
    const std::vector<Node>& nodes = file_.nodes;
    const auto with_geo = std::find_if(nodes.begin(), nodes.end(), [](const Node& n) { return n.geo.has_value(); });
    is_local_ = !origin && std::any_of(nodes.begin(), nodes.end(), [](const Node& n) { return n.local.has_value(); });
    if (is_local_) {
      // Local coordinates of Autoware's maps are offsets within an MGRS square.
      for (const Node& node : nodes) {
        const std::optional<MgrsPlace> square = parse_mgrs(node.mgrs);
        if (!square) continue;
        file_.geo_reference = proj_string_of(square->zone, square->square_m);
        break;
      }
    } else if (origin || with_geo != nodes.end()) {
      const GeoPoint first = origin ? *origin : *with_geo->geo;
      if (!(first.latitude_deg >= -80 && first.latitude_deg <= 84)) {
        fail("{}: expected latitudes in [-80, 84] degrees, those of UTM, got {}", file_.source.name(),
             first.latitude_deg);
      }
      zone_ = utm_zone_of(first);
      if (origin) shift_m_ = to_utm(first, *zone_);
      file_.geo_reference = proj_string_of(*zone_, shift_m_);
    } else {
      for (const Node& node : nodes) {
        const std::optional<MgrsPlace> place = parse_mgrs(node.mgrs);
        if (!place) continue;
        zone_ = place->zone;
        file_.geo_reference = proj_string_of(*zone_, {});
        break;
      }
    }
  }

  std::optional<GridPoint> place(const Node& node) const {
    if (is_local_) return node.local;
    if (!zone_) return std::nullopt;
    if (node.geo) {
      // Far from the central meridian the series does not converge.
      const double meridian_deg = 6.0 * zone_->number - 183;
      if (std::abs(std::remainder(node.geo->longitude_deg - meridian_deg, 360)) > 30) return std::nullopt;
      const GridPoint utm = to_utm(*node.geo, *zone_);
      return GridPoint{utm.x_m - shift_m_.x_m, utm.y_m - shift_m_.y_m};
    }
    const std::optional<MgrsPlace> place = parse_mgrs(node.mgrs);
    if (!place || place->zone.number != zone_->number || place->zone.is_south != zone_->is_south) return std::nullopt;
    return GridPoint{place->square_m.x_m + place->offset_m.x_m - shift_m_.x_m,
                     place->square_m.y_m + place->offset_m.y_m - shift_m_.y_m};
  }

 private:
  OsmFile& file_;
  bool is_local_ = false;
  std::optional<UtmZone> zone_;
  GridPoint shift_m_;
};

}  // namespace

std::string_view Tags::of(std::string_view key) const {
  for (const auto& [own_key, value] : tags_) {
    if (own_key == key) return value;
  }
  return {};
}

std::optional<bool> flag_of(std::string_view value) {
  for (const std::string_view yes : {"yes", "true", "1"}) {
    if (value == yes) return true;
  }
  for (const std::string_view no : {"no", "false", "0"}) {
    if (value == no) return false;
  }
  return std::nullopt;
}

std::vector<int32_t> Relation::ways(std::string_view role) const {
  std::vector<int32_t> found;
  for (const Member& member : members) {
    if (member.way >= 0 && member.role == role) found.push_back(member.way);
  }
  return found;
}

std::vector<int32_t> Relation::relations(std::string_view role) const {
  std::vector<int32_t> found;
  for (const Member& member : members) {
    if (member.relation >= 0 && member.role == role) found.push_back(member.relation);
  }
  return found;
}

opendrive::SourceLocation OsmFile::where(const Relation& relation) const {
  return place(kind_of(relation.tags), "relation", relation);
}

void read_osm(std::string_view text, const std::string& name, opendrive::Faults* faults, OsmFile* file_out) {
  file_out->source = opendrive::Source(name, text);
  opendrive::read_document(text, file_out->source, &file_out->document);
  Reader(faults, file_out).run();
}

void place_nodes(const std::optional<GeoPoint>& origin, const PlanMap& plan, opendrive::Faults* faults,
                 OsmFile* file_inout) {
  OsmFile& file = *file_inout;
  const Placement placement(origin, &file);
  for (Node& node : file.nodes) {
    const std::optional<GridPoint> place = placement.place(node);
    if (!place) continue;
    node.has_position = true;
    node.position_m.x() = plan.xx * place->x_m + plan.xy * place->y_m;
    node.position_m.y() = plan.yx * place->x_m + plan.yy * place->y_m;
  }
  if (!(plan == PlanMap{})) file.geo_reference.clear();  // a deformed copy has no place on Earth
  std::vector<bool> is_recorded(file.nodes.size(), false);
  for (Way& way : file.ways) {
    std::erase_if(way.nodes, [&](int32_t index) {
      const Node& node = file.nodes[index];
      if (node.has_position) return false;
      if (!is_recorded[index]) {
        file.where(node).record_repair(
            faults, RepairKind::missing_position,
            "expected lat and lon, or the tags local_x and local_y, like other nodes of the file");
      }
      is_recorded[index] = true;
      return true;
    });
    if (way.nodes.size() >= 2) continue;
    file.where(way).record_repair(faults, RepairKind::short_way, "expected at least two nodes, got {}",
                                  way.nodes.size());
    way.nodes.clear();
  }
}

std::optional<double> parse_speed_mps(std::string_view text) {
  constexpr double kMaxSpeed_mps = 200;
  const std::size_t end = std::min(text.find_first_not_of("0123456789."), text.size());
  const std::optional<double> number = parse_written_number(text.substr(0, end));
  std::string unit(text.substr(end));
  std::erase(unit, ' ');
  std::optional<double> unit_mps;
  for (const auto& [name, mps] : std::to_array<std::pair<std::string_view, double>>({{"", 1 / 3.6},
                                                                                     {"km/h", 1 / 3.6},
                                                                                     {"kmh", 1 / 3.6},
                                                                                     {"kph", 1 / 3.6},
                                                                                     {"mph", 0.44704},
                                                                                     {"m/s", 1},
                                                                                     {"mps", 1}})) {
    if (unit == name) unit_mps = mps;
  }
  if (!number || !unit_mps || !(*number > 0)) return std::nullopt;
  const double speed_mps = *number * *unit_mps;
  return speed_mps >= 0.1 && speed_mps <= kMaxSpeed_mps ? std::optional(speed_mps) : std::nullopt;
}

}  // namespace pictura::lanelet2
