// The plan of a town: crossings on a jittered grid, streets between them, and which features stand where. All decisions
// that are drawn are taken here, before anything is laid.
#pragma once

#include <vector>

#include "pictura/common/rng.h"
#include "pictura/map/procedural/plan_geometry.h"
#include "pictura/map/procedural/town_options.h"

namespace pictura::town {

// Curves and cross-section of streets.
inline constexpr double kMinStreetRadius_m = 30;  // unless a fifth arm bends a street more
inline constexpr double kLaneWidth_m = 3.5, kShoulderWidth_m = 0.5, kSidewalkWidth_m = 2.5, kParkingWidth_m = 2.3;

/// Int16x8 directions of arms, counter-clockwise from east; streets of the grid have even ones, diagonals odd ones.
inline constexpr int kNumDirections = 8;
constexpr int opposite(int direction) { return (direction + kNumDirections / 2) % kNumDirections; }

/// Where a street meets a node.
struct Arm {
  int street = -1;
  int direction = 0;
  bool at_start = false;  // the street starts here
  double heading = 0;     // of the reference line, away from the node
  double mouth_m = 0;     // from the node to the street's end
};

enum class NodeKind { crossing, roundabout, overpass };

struct Node {
  double x = 0, y = 0;
  double z = 0;        // height of the junction; of the lower street where one crosses over another
  double upper_z = 0;  // of the upper one
  NodeKind kind = NodeKind::crossing;
  bool on_border = false;         // of the grid
  bool upper_runs_north = false;  // of an overpass: which of its streets is the upper one
  bool has_lights = false, far_side_heads = false, has_crosswalks = false;
  std::vector<Arm> arms;  // counter-clockwise

  int degree() const { return static_cast<int>(arms.size()); }
  const Arm& arm(int index) const { return arms[(index + degree()) % degree()]; }
  bool is_bend() const { return kind == NodeKind::crossing && degree() == 2; }
  bool is_crossing() const { return kind == NodeKind::crossing && degree() > 2; }
};

/// A street between two nodes; `leave` and `arrive` are headings along it.
struct Street {
  int from = 0, to = 0;
  int direction = 0;  // of the arm at `from`
  int lanes = 1;      // each way
  bool is_avenue = false, is_kept = true, has_sidewalks = true;
  bool parks_left = false, parks_right = false;
  bool slip_at_start = false, slip_at_end = false;  // a right-turn lane of those who arrive there
  double leave = 0, arrive = 0;
  Curve curve;
  double length_m = 0;
};

/// Radius of the left border of a right turn into an arm that is `gap_rad` away: wide, but close enough to the corner
/// that lanes that go straight on or come across leave no hole beside it.
double right_turn_radius_m(double gap_rad);

class Layout {
 public:
  explicit Layout(const TownOptions& options);

  const TownOptions& options() const { return options_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Street>& streets() const { return streets_; }

  /// Height at the end of a street.
  double end_height_m(int street, bool at_start) const;
  /// Whether those who arrive on this arm have a lane of their own for turning right.
  bool has_slip(const Arm& arm) const;

 private:
  // In the order in which they run.
  void place_nodes();
  void plan_streets();
  void choose_avenues();
  void choose_overpasses();
  void choose_roundabouts();
  void add_diagonals();
  void thin_out();
  void choose_street_features();
  void join_streets();
  void choose_crossing_features();
  // layout_curves.cpp
  void set_headings();
  void spread_arms(Node* node);
  void curve_streets();
  void choose_slip_lanes();
  void lay_curves();
  // layout_heights.cpp
  void set_heights();

  /// Draws for one thing of the town: what it is drawn for, and which one.
  RandomStream draw(uint32_t what, int index) const {
    return {options_.seed, static_cast<uint32_t>(index), 0, what, 0, Purpose::town};
  }
  /// `share` of the candidates, in an order that is drawn: at least one unless the share is 0 or there is none.
  std::vector<int> pick(double share, std::vector<int> candidates, uint32_t what) const;
  /// All candidates in an order that is drawn.
  std::vector<int> shuffled(std::vector<int> candidates, uint32_t what) const;

  int node_at(int column, int row) const { return row * (options_.blocks_x + 1) + column; }
  Street& add_street(int from, int to, int direction);
  std::vector<int> streets_at(int node) const;
  bool has_single_lanes(int node) const;
  bool is_connected() const;
  bool may_go(int street) const;
  double mouth_distance_m(const Node& node, int arm) const;
  Curve curve_of(const Street& street) const;
  void set_arm_heading(int street, bool at_start, double heading);
  bool is_crowded(const Node& node) const;

  TownOptions options_;
  bool has_ring_road_ = false;
  std::vector<Node> nodes_;
  std::vector<Street> streets_;
};

}  // namespace pictura::town
