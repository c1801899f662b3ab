// Layout of a town: crossings on a jittered grid, and streets between them. Makes all random decisions.
#pragma once

#include <utility>
#include <vector>

#include "pictura/common/rng.h"
#include "pictura/map/procedural/plan_geometry.h"
#include "pictura/map/procedural/town_options.h"

namespace pictura::town {

inline constexpr double kMinStreetRadius_m = 30;  // except next to the fifth arm of a crossing
inline constexpr double kShoulderWidth_m = 0.5, kSidewalkWidth_m = 2.5, kParkingWidth_m = 2.3, kHalfMedian_m = 1;

/// Directions of arms, counter-clockwise from east. Diagonals have odd directions.
inline constexpr int kNumDirections = 8;
inline constexpr int kStepX[kNumDirections] = {1, 1, 0, -1, -1, -1, 0, 1};
inline constexpr int kStepY[kNumDirections] = {0, 1, 1, 1, 0, -1, -1, -1};
constexpr int opposite(int direction) { return (direction + kNumDirections / 2) % kNumDirections; }

/// The end of a street at a node.
struct Arm {
  int street = -1;
  int direction = 0;
  bool at_start = false;                            // the street starts here
  bool has_arrivals = true, has_departures = true;  // traffic arrives at the node, or leaves it
  double heading = 0;                               // heading away from the node
  double mouth_m = 0;                               // distance from the node to the street's end
};

/// At a fork, one carriageway of a motorway has an exit to a ramp, and the other has an entry.
enum class NodeKind { crossing, roundabout, overpass, fork };

/// Connectors lead from the town to its motorway. Ramps are one-way.
enum class StreetKind { street, avenue, connector, ramp, motorway };

struct Node {
  Eigen::Vector2d position_m{0, 0};
  double z = 0;        // height of the junction, or of the lower street of an overpass
  double upper_z = 0;  // upper street of an overpass
  NodeKind kind = NodeKind::crossing;
  bool on_border = false;
  bool upper_runs_north = false;  // else it runs east
  bool has_lights = false, far_side_heads = false, has_crosswalks = false;
  std::vector<Arm> arms;  // counter-clockwise

  int degree() const { return static_cast<int>(arms.size()); }
  const Arm& arm(int index) const { return arms[(index + degree()) % degree()]; }
  bool is_bend() const { return kind == NodeKind::crossing && degree() == 2; }
  bool is_crossing() const { return kind == NodeKind::crossing && degree() > 2; }
};

/// A street between two nodes. `leave` and `arrive` are its headings at both ends.
struct Street {
  int from = 0, to = 0;
  int direction = 0, end_direction = 0;  // arm directions at `from` and at `to`
  StreetKind kind = StreetKind::street;
  int lanes = 1;  // in each direction
  double lane_width_m = 0;
  bool is_present = true, has_sidewalks = true;
  bool parks_left = false, parks_right = false;
  bool slip_at_start = false, slip_at_end = false;  // right-turn lane for traffic that arrives there
  double leave = 0, arrive = 0;
  double start_offset_m = 0, end_offset_m = 0;  // shift of each end to the right
  Curve curve;
  double length_m = 0;
};

/// Distance from the reference line to the left border of a lane.
inline double lane_offset_m(const Street& street, int lane) {
  return (street.kind == StreetKind::motorway ? kHalfMedian_m : 0) + lane * street.lane_width_m;
}

/// Nodes of a motorway interchange, in the order in which traffic on the carriageway nearer to the town passes them.
struct Interchange {
  int entry_fork = -1, overpass = -1, exit_fork = -1;
};

/// Pose of the end of a street, heading away from the node.
inline Pose mouth_pose(const Node& node, const Arm& arm, const Street& street, double mouth_m) {
  const Pose on_ray = moved_forward({node.position_m, arm.heading}, mouth_m);
  return offset_right(on_ray, arm.at_start ? street.start_offset_m : -street.end_offset_m);
}

/// Radius of the left border of a right turn between arms whose headings differ by `gap_rad`. The turn is wide, but
/// leaves no gap in the junction's surface.
double right_turn_radius_m(double gap_rad, double lane_width_m);

class Layout {
 public:
  explicit Layout(const TownOptions& options);

  const TownOptions& options() const { return options_; }
  double lane_width_m() const { return lane_width_m_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Street>& streets() const { return streets_; }

  double end_height_m(int street, bool at_start) const;
  /// Whether traffic that arrives on this arm has a right-turn lane (slip lane).
  bool has_slip(const Arm& arm) const;
  /// Returns the largest number of lanes per direction of the node's streets. A roundabout's circle has as many lanes.
  int max_lanes_of(const Node& node) const;

 private:
  /// Purposes of random draws, each with its own stream.
  enum DrawPurpose : uint32_t {
    kSpacing,
    kJitter,
    kRingRoad,
    kAvenues,
    kAvenueLanes,
    kOverpasses,
    kUpperStreet,
    kRoundabouts,
    kFiveArms,
    kDiagonals,
    kThinning,
    kSidewalks,
    kParking,
    kLights,
    kFarSide,
    kCrosswalks,
    kMotorway,
    kLaneWidth,
    kCurved = 100,
    kCurveShape,
    kSlipLanes,
    kHills = 200,
  };

  // Stages of each file, in the order of execution.
  void place_nodes();
  void plan_streets();
  void choose_avenues();
  void choose_overpasses();
  void add_motorway();
  void choose_roundabouts();
  void add_diagonals();
  void remove_streets();
  void choose_street_features();
  void join_streets();
  void choose_crossing_features();
  // layout_curves.cpp
  void set_headings();
  void spread_arms(Node* node);
  void curve_streets();
  void remove_large_roundabouts();
  void choose_slip_lanes();
  void build_curves();
  // layout_heights.cpp
  void set_heights();

  /// Returns the random stream of one decision (`purpose`) about one element (`index`).
  RandomStream draw(uint32_t purpose, int index) const {
    return RandomStream(
        {.seed = options_.seed, .world = static_cast<uint32_t>(index), .episode = purpose, .purpose = Purpose::town});
  }
  /// Selects a fraction of the candidates at random, at least one unless the fraction is 0.
  std::vector<int> pick(double fraction, std::vector<int> candidates, uint32_t purpose) const;
  std::vector<int> shuffled(std::vector<int> candidates, uint32_t purpose) const;

  int node_at(int column, int row) const { return row * (options_.blocks_x + 1) + column; }
  Street& add_street(int from, int to, int direction);
  // layout_motorway.cpp
  int add_node(const Eigen::Vector2d& position_m);
  Interchange add_interchange(int border_node, int side, double motorway_m, int through_lanes);
  void add_ramp(int from, int to, int direction, int end_direction, int through_lanes);
  std::vector<int> streets_at(int node) const;
  int max_lanes_at(int node) const;
  bool has_ramps(int node) const;
  bool is_connected() const;
  bool is_removable(int street) const;
  double mouth_distance_m(const Node& node, int arm) const;
  double mouth_distance_m(const Street& street, int node) const;
  std::pair<Pose, Pose> ends_of(const Street& street) const;
  bool fits_between_mouths(const Street& street) const;
  Curve curve_of(const Street& street) const;
  void set_arm_heading(int street, bool at_start, double heading);
  bool has_close_arms(const Node& node) const;

  TownOptions options_;
  double lane_width_m_ = 0;
  bool has_ring_road_ = false;
  std::vector<Node> nodes_;
  std::vector<Street> streets_;
};

}  // namespace pictura::town
