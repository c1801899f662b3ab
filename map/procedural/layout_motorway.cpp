// Motorway around the town: its interchanges, ramps and bends.
#include <algorithm>
#include <array>

#include "pictura/map/procedural/layout.h"

namespace pictura::town {

namespace {

constexpr double kMotorwayDistance_m = 110;  // from the outermost crossings
constexpr double kTerminal_m = 45;           // from the motorway to the crossings where its ramps end
constexpr double kFork_m = 150;              // from the overpass to the forks
constexpr double kReach_m = 275;             // from the overpass to the bends, including half of the bend
constexpr double kGore_m = 1.5;              // between the motorway and a ramp that has left it

Eigen::Vector2d unit(int direction) { return Eigen::Vector2d(kStepX[direction], kStepY[direction]); }

/// Direction of the inner carriageway on this side of the town. It is clockwise, because traffic keeps right.
constexpr int along(int side) { return (side + 6) % kNumDirections; }

}  // namespace

int Layout::add_node(const Eigen::Vector2d& position_m) {
  Node& node = nodes_.emplace_back();
  node.position_m = position_m;
  node.on_border = true;
  return static_cast<int>(nodes_.size()) - 1;
}

void Layout::add_ramp(int from, int to, int direction, int end_direction, int through_lanes) {
  Street& ramp = add_street(from, to, direction);
  ramp.kind = StreetKind::ramp;
  ramp.end_direction = end_direction;
  const double offset_m = kHalfMedian_m + through_lanes * lane_width_m_ + kGore_m;
  (nodes_[from].kind == NodeKind::fork ? ramp.start_offset_m : ramp.end_offset_m) = offset_m;
}

/// Adds a diamond interchange: a connector leads from the town under the motorway, and crosses the ramps of each
/// carriageway.
Interchange Layout::add_interchange(int border_node, int side, double motorway_m, int through_lanes) {
  const int forward = along(side), back = opposite(forward);
  const Eigen::Vector2d origin = nodes_[border_node].position_m;
  const Eigen::Vector2d center = origin + (motorway_m - origin.dot(unit(side))) * unit(side);
  const Interchange added{add_node(center - kFork_m * unit(forward)), add_node(center),
                          add_node(center + kFork_m * unit(forward))};
  const int inner = add_node(center - kTerminal_m * unit(side)), outer = add_node(center + kTerminal_m * unit(side));
  nodes_[added.entry_fork].kind = nodes_[added.exit_fork].kind = NodeKind::fork;
  nodes_[added.overpass].kind = NodeKind::overpass;
  nodes_[added.overpass].upper_runs_north = forward % 4 == 2;

  int town_lanes = 1;  // lanes of the street that the connector continues
  for (const int street : streets_at(border_node)) {
    if (streets_[street].direction % 4 == side % 4) town_lanes = streets_[street].lanes;
  }
  const auto connect = [&](int from, int to, int lanes) {
    Street& street = add_street(from, to, side);
    street.kind = StreetKind::connector;
    street.lanes = lanes;
  };
  connect(border_node, inner, std::min(town_lanes, 2));
  connect(inner, added.overpass, 1);
  connect(added.overpass, outer, 1);
  // At forks, ramps have the odd directions next to the motorway's directions.
  const auto turned = [](int direction, int steps) { return (direction + steps) % kNumDirections; };
  add_ramp(added.entry_fork, inner, turned(forward, 7), back, through_lanes);
  add_ramp(inner, added.exit_fork, forward, turned(back, 1), through_lanes);
  add_ramp(added.exit_fork, outer, turned(back, 7), forward, through_lanes);
  add_ramp(outer, added.entry_fork, back, turned(forward, 1), through_lanes);
  return added;
}

/// Adds interchanges on opposite sides of the town. Each is next to a crossing that is not a corner of the grid.
void Layout::add_motorway() {
  if (draw(kMotorway, 0).uniform() >= static_cast<float>(options_.motorway)) return;
  constexpr std::array<int, 4> kSides{6, 4, 2, 0};  // clockwise from the south
  std::array<std::vector<int>, 4> behind;           // candidates for crossings next to an interchange
  for (int i = 1; i < options_.blocks_x; ++i) {
    behind[0].push_back(node_at(i, 0));
    behind[2].push_back(node_at(i, options_.blocks_y));
  }
  for (int j = 1; j < options_.blocks_y; ++j) {
    behind[1].push_back(node_at(0, j));
    behind[3].push_back(node_at(options_.blocks_x, j));
  }
  std::size_t first = draw(kMotorway, 1).below(2);
  if (behind[first].empty()) first = 1 - first;
  if (behind[first].empty()) return;

  std::array<double, 4> motorway_m{};  // distance of the motorway from the origin, on each side
  std::array<int, 4> chosen{-1, -1, -1, -1};
  for (std::size_t k = 0; k < 4; ++k) {
    for (const Node& node : nodes_) {
      motorway_m[k] = std::max(motorway_m[k], node.position_m.dot(unit(kSides[k])) + kMotorwayDistance_m);
    }
  }
  for (const std::size_t k : {first, first + 2}) {
    chosen[k] = behind[k][draw(kMotorway, 2 + static_cast<int>(k)).below(static_cast<int>(behind[k].size()))];
    for (const std::size_t beside : {(k + 1) % 4, (k + 3) % 4}) {
      const double along_m = nodes_[chosen[k]].position_m.dot(unit(kSides[beside]));
      motorway_m[beside] = std::max(motorway_m[beside], along_m + kReach_m);
    }
  }

  std::array<int, 4> corners{};  // corner k is the end of side k
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t next = (k + 1) % 4;
    corners[k] = add_node(motorway_m[k] * unit(kSides[k]) + motorway_m[next] * unit(kSides[next]));
  }
  // Lanes per direction at interchanges. Between interchanges there is one more.
  const int through_lanes = 2 + draw(kMotorway, 6).below(2);
  const auto build = [&](int from, int to, int side, int lanes) {
    Street& street = add_street(from, to, along(side));
    street.kind = StreetKind::motorway;
    street.lanes = lanes;
  };
  for (std::size_t k = 0; k < 4; ++k) {
    int from = corners[(k + 3) % 4];
    if (chosen[k] >= 0) {
      const Interchange added = add_interchange(chosen[k], kSides[k], motorway_m[k], through_lanes);
      build(from, added.entry_fork, kSides[k], through_lanes + 1);
      build(added.entry_fork, added.overpass, kSides[k], through_lanes);
      build(added.overpass, added.exit_fork, kSides[k], through_lanes);
      from = added.exit_fork;
    }
    build(from, corners[k], kSides[k], through_lanes + 1);
  }
}

}  // namespace pictura::town
