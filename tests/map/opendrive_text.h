// Evaluation of OpenDRIVE text for tests: of lines, arcs, widths and elevations, and of simple rules of the standard.
// It shares no code with the writer or the importer.
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

/// Returns the rules of OpenDRIVE 1.4 that the text violates. It checks that required attributes exist, stations
/// ascend, lane ids count from the centre, ids are unique, links have targets and are mutual, and junction connections
/// agree with their roads.
std::vector<std::string> violated_rules(const OpenDriveText& text);

struct Pose {
  double x = 0, y = 0, heading = 0;
};

/// Returns the pose on a line or an arc, ds metres from its start.
Pose on_geometry(const pugi::xml_node& geometry, double ds);

/// End of a lane at an end of its road: positions of the inner and outer border, heading of +s, height, and grade along
/// +s.
struct LaneEnd {
  double inner_x = 0, inner_y = 0, outer_x = 0, outer_y = 0, heading = 0, z = 0, grade = 0;
};
LaneEnd lane_end(const pugi::xml_node& road, int lane, bool at_start);

/// Returns the lane with this id in the first or last section of a road; an empty node if there is none.
pugi::xml_node lane_at(const pugi::xml_node& road, int lane, bool at_start);

/// Returns all lanes of a section, from left to right, without the centre lane.
std::vector<pugi::xml_node> lanes_of(const pugi::xml_node& section);

inline bool is(const pugi::xml_node& node, const char* attribute, const char* value) {
  return std::string(node.attribute(attribute).value()) == value;
}

}  // namespace pictura::test
