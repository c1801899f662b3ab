// Builds a town's Network from its Layout.
#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "pictura/map/opendrive/model.h"
#include "pictura/map/procedural/cross_section.h"
#include "pictura/map/procedural/layout.h"
#include "pictura/map/procedural/movements.h"

namespace pictura::town {

struct RoadEnd {
  int road = -1;
  bool at_start = false;
};

struct EndSides {
  Side left, right;
};

class TownBuilder {
 public:
  explicit TownBuilder(const Layout& layout);

  opendrive::Network take() { return std::move(network_); }

 private:
  void build_street(int street);
  void build_bend(const Node& node, const Arm& from, const Arm& to, double height_m);
  // crossings.cpp
  void build_crossing(const Node& node);
  int build_movement(const Node& node, const Movement& movement, opendrive::FileJunction* junction);
  void add_crosswalk(const Arm& arm, int owner_road);
  // roundabouts.cpp
  void build_roundabout(const Node& node);
  // signals.cpp
  void add_lights(const Node& node, const std::vector<Movement>& movements, const std::vector<int>& roads,
                  opendrive::FileJunction* junction);

  const Street& street_of(const Arm& arm) const { return layout_.streets()[arm.street]; }
  /// The network's first roads are the layout's streets, in the same order.
  static RoadEnd end_of(const Arm& arm) { return {arm.street, arm.at_start}; }
  Pose mouth_of(const Node& node, const Arm& arm) const { return mouth_pose(node, arm, street_of(arm), arm.mouth_m); }

  /// Adds a road with one section. One-way roads ignore `left`.
  int add_road(Curve curve, double height_m, const std::string& junction, double speed_mps, const Side& left,
               const Side& right, const SectionStyle& style);
  EndSides& sides_at(RoadEnd end) { return end_sides_[2 * end.road + (end.at_start ? 0 : 1)]; }
  /// Returns the side on which traffic arrives at this end, or leaves it.
  const Side& side(RoadEnd end, bool arriving) {
    return arriving == end.at_start ? sides_at(end).left : sides_at(end).right;
  }
  /// Returns a lane's id, or 0 if there is no such lane.
  int lane_id(RoadEnd end, bool arriving, LaneKind kind, int index = 0) {
    return side(end, arriving).rank(kind, index) * (arriving == end.at_start ? 1 : -1);
  }
  void set_lane_link(RoadEnd end, int lane, int other);
  void set_road_link(RoadEnd end, RoadEnd other);
  void set_junction_link(RoadEnd end, const std::string& junction);
  /// Links two road ends lane by lane, in both directions.
  void join(RoadEnd a, RoadEnd b);
  /// Connects the movement's lanes at `from` to those at `to`. The road `connecting` begins at `from`.
  void connect(RoadEnd from, int connecting, RoadEnd to, const Movement& movement, opendrive::FileJunction* junction);
  void finish_junction(opendrive::FileJunction junction);

  std::string next_id() { return fmt::format("{}", next_id_++); }
  opendrive::FileRoad& road(int index) { return network_.roads[index]; }

  const Layout& layout_;
  opendrive::Network network_;
  std::vector<EndSides> end_sides_;  // [roads][start, end]
  int next_id_ = 1000000;            // for elements other than roads
};

inline constexpr double mph(double speed) { return speed * 0.44704; }
inline constexpr double kJunctionSpeed_mps = mph(20), kRoundaboutSpeed_mps = mph(15), kMotorwayBendSpeed_mps = mph(45);
constexpr double speed_mps(StreetKind kind) {
  switch (kind) {
    case StreetKind::street: return mph(25);
    case StreetKind::avenue:
    case StreetKind::connector:
    case StreetKind::ramp: return mph(35);
    case StreetKind::motorway: return mph(65);
  }
  return 0;
}

}  // namespace pictura::town
