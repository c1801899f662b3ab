// Evaluation of OpenDRIVE text, independent of the writer and the importer.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include <pugixml.hpp>

namespace pictura::test {

class OpenDriveText {
 public:
  explicit OpenDriveText(const std::string& text);

  pugi::xml_node root() const { return document_.child("OpenDRIVE"); }
  pugi::xml_node road(const std::string& id) const {
    const auto found = roads_.find(id);
    return found == roads_.end() ? pugi::xml_node() : found->second;
  }
  int count(const char* xpath) const { return static_cast<int>(document_.select_nodes(xpath).size()); }

 private:
  pugi::xml_document document_;
  std::unordered_map<std::string, pugi::xml_node> roads_;
};

/// Returns the violated rules of OpenDRIVE 1.4: required attributes, ascending stations, lane ids counted from the
/// centre, unique ids, mutual links, and connections that agree with their roads.
std::vector<std::string> violated_rules(const OpenDriveText& text);

struct Pose {
  double x = 0, y = 0, heading = 0;
};

/// Returns the pose ds metres from the start of a line or an arc.
Pose on_geometry(const pugi::xml_node& geometry, double ds);

/// End of a lane: inner and outer border, heading of +s, height, and grade along +s.
struct LaneEnd {
  double inner_x = 0, inner_y = 0, outer_x = 0, outer_y = 0, heading = 0, z = 0, grade = 0;
};
LaneEnd lane_end(const pugi::xml_node& road, int lane, bool at_start);

/// Returns a lane of the first or last section; an empty node if there is none.
pugi::xml_node lane_at(const pugi::xml_node& road, int lane, bool at_start);

/// Returns a section's lanes from left to right, without the centre lane.
std::vector<pugi::xml_node> lanes_of(const pugi::xml_node& section);

inline bool is(const pugi::xml_node& node, const char* attribute, const char* value) {
  return std::string(node.attribute(attribute).value()) == value;
}

}  // namespace pictura::test
