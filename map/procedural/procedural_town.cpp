// Writes a town as OpenDRIVE 1.4: nodes of a jittered grid, streets between them as lines and arcs, a junction with one
// phase per approach at every node of three or four arms, a plain bend at the four corners. Reference lines are
// computed in double and written with ten decimals, so that pieces meet within a nanometre.
#include "pictura/map/procedural/procedural_town.h"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pugixml.hpp>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"

namespace pictura {

namespace {

constexpr int kMaxBlocks = 32;
constexpr double kPiD = std::numbers::pi;

// Node spacing before jitter, and jitter of each coordinate: block edges lie between 60 and 100 m.
constexpr double kMinSpacing_m = 68, kMaxSpacing_m = 91, kJitter_m = 3.5;

constexpr double kLaneWidth_m = 3.5, kShoulderWidth_m = 0.5, kSidewalkWidth_m = 2.5, kParkingWidth_m = 2.3;
// A street's parking bays open and close over the taper, the lead away from its ends.
constexpr double kParkingLead_m = 4, kParkingTaper_m = 4;
constexpr double kMinParkingStreet_m = 36;

// From a node to the mouths of its arms: far enough for the sidewalk to turn the corner, near enough for turning lanes
// and crossing lanes to leave no hole between them.
constexpr double kMouth_m = 12, kAvenueMouth_m = 17, kBendMouth_m = 20;
constexpr double kMinArmAngle_rad = 75 * kPiD / 180, kMinOppositeAngle_rad = 150 * kPiD / 180;
constexpr double kMinStreetRadius_m = 30;
// A right turn from or to the outer of two lanes hugs its corner, so that it meets the left turn beside it.
constexpr double kTightTurn = 0.7;

constexpr double kCrosswalkBegin_m = 0.6, kCrosswalkEnd_m = 3.4;  // beyond the stop line
constexpr double kPostSetback_m = 0.8;                            // of a signal's post, behind the kerb
constexpr int kStreetSpeed_mph = 25, kAvenueSpeed_mph = 35, kJunctionSpeed_mph = 20;

struct Pose {
  double x = 0, y = 0, heading = 0;
};

Pose ahead(Pose p, double distance) {
  return {p.x + distance * std::cos(p.heading), p.y + distance * std::sin(p.heading), p.heading};
}
Pose to_the_right(Pose p, double distance) {
  return {p.x + distance * std::sin(p.heading), p.y - distance * std::cos(p.heading), p.heading};
}
Pose turned_back(Pose p) { return {p.x, p.y, p.heading + kPiD}; }
double wrapped(double angle) { return std::remainder(angle, 2 * kPiD); }

/// A line (curvature 0) or an arc of a reference line.
struct Piece {
  Pose start;
  double length = 0, curvature = 0;
};
using Curve = std::vector<Piece>;

double length_of(const Curve& curve) {
  double length = 0;
  for (const Piece& piece : curve) length += piece.length;
  return length;
}

/// The arc (or line) that leaves `from` along its heading and ends at (x, y).
Piece arc_to(Pose from, double x, double y) {
  const double chord = std::hypot(x - from.x, y - from.y);
  const double chord_heading = std::atan2(y - from.y, x - from.x);
  const double half_turn = wrapped(chord_heading - from.heading);
  if (std::abs(half_turn) < 1e-9) return {{from.x, from.y, chord_heading}, chord, 0};
  return {from, chord * half_turn / std::sin(half_turn), 2 * std::sin(half_turn) / chord};
}

/// Two arcs with a common tangent, the control arms of both equally long; one piece where one is enough.
Curve biarc(Pose from, Pose to) {
  const double from_x = std::cos(from.heading), from_y = std::sin(from.heading);
  const double to_x = std::cos(to.heading), to_y = std::sin(to.heading);
  const double dx = to.x - from.x, dy = to.y - from.y;
  const double along = dx * (from_x + to_x) + dy * (from_y + to_y);
  const double chord2 = dx * dx + dy * dy;
  const double bend = 2 * (1 - (from_x * to_x + from_y * to_y));
  const double arm = chord2 / (along + std::sqrt(along * along + bend * chord2));
  const double middle_x = 0.5 * (from.x + to.x + arm * (from_x - to_x));
  const double middle_y = 0.5 * (from.y + to.y + arm * (from_y - to_y));
  const Piece first = arc_to(from, middle_x, middle_y);
  const Pose joint{middle_x, middle_y, from.heading + first.curvature * first.length};
  const Piece second = arc_to(joint, to.x, to.y);
  if (std::abs(first.curvature - second.curvature) < 1e-9) return {arc_to(from, to.x, to.y)};
  return {first, second};
}

/// A line, an arc and a line, tangent to each other: the widest arc that fits, times `tightness`.
Curve fillet(Pose from, Pose to, double tightness) {
  const double turn = wrapped(to.heading - from.heading);
  const double sine = std::sin(turn);
  const double dx = to.x - from.x, dy = to.y - from.y;
  // Distances from both ends to the crossing of their tangents.
  const double lead_in = (dx * std::sin(to.heading) - dy * std::cos(to.heading)) / sine;
  const double lead_out = (dy * std::cos(from.heading) - dx * std::sin(from.heading)) / sine;
  const double tangent = tightness * std::min(lead_in, lead_out);
  const double curvature = std::tan(0.5 * turn) / tangent;
  Curve curve;
  constexpr double kLeastLine_m = 1e-7;
  Pose at = from;
  if (lead_in - tangent > kLeastLine_m) {
    curve.push_back({at, lead_in - tangent, 0});
    at = ahead(at, lead_in - tangent);
  }
  const Pose arc_end = ahead(to, -std::max(0.0, lead_out - tangent));
  curve.push_back({at, turn / curvature, curvature});
  if (lead_out - tangent > kLeastLine_m) curve.push_back({arc_end, lead_out - tangent, 0});
  return curve;
}

/// Kinds of lanes from the reference line outwards; the first and the second driving lane are told apart for linking.
enum class LaneKind { inner_driving, outer_driving, parking, shoulder, sidewalk };

struct TownLane {
  LaneKind kind;
  int predecessor = 0, successor = 0;  // ids of lanes; 0: none
};

/// One side of a road, from the reference line outwards: lane i has the id -(i + 1) on the right, i + 1 on the left.
using Side = std::vector<TownLane>;

Side make_side(int driving_lanes, bool parking, bool walk) {
  Side side{{LaneKind::inner_driving}};
  if (driving_lanes == 2) side.push_back({LaneKind::outer_driving});
  if (parking) side.push_back({LaneKind::parking});
  if (walk) {
    side.push_back({LaneKind::shoulder});
    side.push_back({LaneKind::sidewalk});
  }
  return side;
}

/// Position of a kind on a side, counted from 1; 0 where there is none.
int rank_of(const Side& side, LaneKind kind) {
  for (size_t i = 0; i < side.size(); ++i) {
    if (side[i].kind == kind) return static_cast<int>(i) + 1;
  }
  return 0;
}

/// What a road is joined to at one of its ends.
struct Joint {
  bool is_junction = false;
  int id = -1;
  bool at_start = false;  // contact point, for roads
};

struct Signal {
  int id = 0;
  double s = 0, t = 0, heading_offset = 0;
  bool for_forward_traffic = true;
};

struct SignalReference {
  int id = 0;
  int lanes = 1;  // valid for the right lanes -1 .. -lanes
};

struct Road {
  int id = 0;
  std::string name;
  int junction = -1;
  int speed_mph = kStreetSpeed_mph;
  Curve curve;
  Side left, right;
  Joint predecessor, successor;
  double crosswalk_half_width = 0;  // > 0: a crosswalk begins just after the road's start
  int crosswalk_id = 0;
  std::vector<Signal> signals;
  std::vector<SignalReference> references;

  double length() const { return length_of(curve); }
  int driving_lanes() const { return rank_of(right, LaneKind::outer_driving) ? 2 : 1; }
};

/// Where a street meets a node.
struct Arm {
  int street = -1;        // index of the road; -1: no street this way
  bool at_start = false;  // the street starts here
  Pose mouth;             // on the reference line, heading away from the node

  bool exists() const { return street >= 0; }
};

// Directions of arms, counter-clockwise: east, north, west, south.
constexpr int kNumDirections = 4;
constexpr std::array<int, kNumDirections> kStepX{1, 0, -1, 0}, kStepY{0, 1, 0, -1};

struct Node {
  double x = 0, y = 0;
  bool on_ring = false;
  std::array<Arm, kNumDirections> arms;

  int num_arms() const {
    int count = 0;
    for (const Arm& arm : arms) count += arm.exists();
    return count;
  }
};

struct JunctionConnection {
  int incoming_road = 0, connecting_road = 0;
  std::vector<std::pair<int, int>> lane_links;
};

struct TownJunction {
  int id = 0;
  std::vector<JunctionConnection> connections;
  std::vector<int> controllers;  // in the order of their phases
};

struct Controller {
  int id = 0, signal = 0, phase = 0;
};

/// A street that is planned but not yet laid: between two nodes, leaving and arriving under given headings.
struct Plan {
  int from = 0, to = 0;
  int direction = 0;  // of the arm at `from`: east or north
  bool avenue = false;
  double leave = 0, arrive = 0;  // headings along the street
};

/// Lays a town out; the steps run in the order of the functions.
class Town {
 public:
  explicit Town(const TownOptions& options)
      : seed_(options.seed), blocks_x_(options.blocks_x), blocks_y_(options.blocks_y) {
    has_avenue_ = draw(0, 0).uniform() < 0.5f;
    place_nodes();
    plan_streets();
    curve_streets();
    lay_streets();
    for (size_t node = 0; node < nodes_.size(); ++node) {
      if (nodes_[node].num_arms() == 2) {
        lay_bend(nodes_[node]);
      } else {
        lay_junction(static_cast<uint32_t>(node));
      }
    }
  }

  std::string xml() const;

 private:
  /// Draws for one thing of the town: what it is drawn for, and which one.
  RandomStream draw(uint32_t what, uint32_t index) const { return {seed_, index, 0, what, 0, Purpose::town}; }

  int node_at(int column, int row) const { return row * (blocks_x_ + 1) + column; }
  double mouth_distance(int node) const {
    const Node& n = nodes_[static_cast<size_t>(node)];
    if (degrees_[static_cast<size_t>(node)] == 2) return kBendMouth_m;
    return has_avenue_ && n.on_ring ? kAvenueMouth_m : kMouth_m;
  }
  Road& road(int id) { return roads_[static_cast<size_t>(id)]; }
  const Road& road(int id) const { return roads_[static_cast<size_t>(id)]; }

  void place_nodes();
  void plan_streets();
  void curve_streets();
  void lay_streets();
  void lay_bend(const Node& node);
  void lay_junction(uint32_t node_index);
  Road& add_road(const std::string& name, int junction, Curve curve);
  int arm_lane(const Arm& arm, LaneKind kind, bool incoming) const;
  bool bends_too_much(const Plan& plan) const;

  uint64_t seed_;
  int blocks_x_, blocks_y_;
  bool has_avenue_ = false;  // the ring around the town has two lanes each way
  std::vector<Node> nodes_;
  std::vector<int> degrees_;  // [nodes] planned arms
  std::vector<Plan> plans_;
  std::vector<Road> roads_;
  std::vector<TownJunction> junctions_;
  std::vector<Controller> controllers_;
  int next_id_ = 1000000;  // of everything that is not a road
};

void Town::place_nodes() {
  std::vector<double> columns(1, 0.0), rows(1, 0.0);
  RandomStream x_stream = draw(1, 0), y_stream = draw(1, 1);
  for (int i = 0; i < blocks_x_; ++i)
    columns.push_back(columns.back() + x_stream.uniform(kMinSpacing_m, kMaxSpacing_m));
  for (int j = 0; j < blocks_y_; ++j) rows.push_back(rows.back() + y_stream.uniform(kMinSpacing_m, kMaxSpacing_m));
  for (int j = 0; j <= blocks_y_; ++j) {
    for (int i = 0; i <= blocks_x_; ++i) {
      RandomStream jitter = draw(2, static_cast<uint32_t>(nodes_.size()));
      Node node;
      node.x = columns[static_cast<size_t>(i)] - 0.5 * columns.back() + jitter.uniform(-kJitter_m, kJitter_m);
      node.y = rows[static_cast<size_t>(j)] - 0.5 * rows.back() + jitter.uniform(-kJitter_m, kJitter_m);
      node.on_ring = i == 0 || j == 0 || i == blocks_x_ || j == blocks_y_;
      nodes_.push_back(node);
    }
  }
}

void Town::plan_streets() {
  degrees_.assign(nodes_.size(), 0);
  for (int j = 0; j <= blocks_y_; ++j) {
    for (int i = 0; i <= blocks_x_; ++i) {
      for (int direction = 0; direction < 2; ++direction) {
        const int to_i = i + kStepX[static_cast<size_t>(direction)], to_j = j + kStepY[static_cast<size_t>(direction)];
        if (to_i > blocks_x_ || to_j > blocks_y_) continue;
        Plan plan;
        plan.from = node_at(i, j);
        plan.to = node_at(to_i, to_j);
        plan.direction = direction;
        const bool on_ring = direction == 0 ? (j == 0 || j == blocks_y_) : (i == 0 || i == blocks_x_);
        plan.avenue = has_avenue_ && on_ring;
        plans_.push_back(plan);
        ++degrees_[static_cast<size_t>(plan.from)];
        ++degrees_[static_cast<size_t>(plan.to)];
      }
    }
  }
  // Streets may be left out between crossings that still have four arms. The town stays connected: whatever group of
  // inner nodes, its corner has two streets out of the group and has lost at most one.
  std::vector<Plan> kept;
  for (size_t i = 0; i < plans_.size(); ++i) {
    int& from_degree = degrees_[static_cast<size_t>(plans_[i].from)];
    int& to_degree = degrees_[static_cast<size_t>(plans_[i].to)];
    constexpr float kLeaveOut = 0.2f;
    if (from_degree == 4 && to_degree == 4 && draw(3, static_cast<uint32_t>(i)).uniform() < kLeaveOut) {
      --from_degree;
      --to_degree;
    } else {
      kept.push_back(plans_[i]);
    }
  }
  plans_ = std::move(kept);
}

bool Town::bends_too_much(const Plan& plan) const {
  const Node& from = nodes_[static_cast<size_t>(plan.from)];
  const Node& to = nodes_[static_cast<size_t>(plan.to)];
  const Pose start = ahead({from.x, from.y, plan.leave}, mouth_distance(plan.from));
  const Pose end = ahead({to.x, to.y, plan.arrive}, -mouth_distance(plan.to));
  for (const Piece& piece : biarc(start, end)) {
    if (std::abs(piece.curvature) > 1 / kMinStreetRadius_m) return true;
  }
  return false;
}

void Town::curve_streets() {
  // Headings of the planned arms, by node and direction; straight first, then bent one by one while the angles between
  // neighbouring arms stay wide enough.
  constexpr double kNone = 1e9;
  std::vector<std::array<double, kNumDirections>> arms(nodes_.size(), {kNone, kNone, kNone, kNone});
  const auto arm_of = [&](const Plan& plan, bool at_from) -> double& {
    return at_from ? arms[static_cast<size_t>(plan.from)][static_cast<size_t>(plan.direction)]
                   : arms[static_cast<size_t>(plan.to)][static_cast<size_t>(plan.direction + 2)];
  };
  const auto crowded = [&](int node) {
    const auto& headings = arms[static_cast<size_t>(node)];
    for (size_t a = 0; a < kNumDirections; ++a) {
      for (size_t b = 0; b < a; ++b) {
        if (headings[a] == kNone || headings[b] == kNone) continue;
        const double least = a - b == 2 ? kMinOppositeAngle_rad : kMinArmAngle_rad;
        if (std::abs(wrapped(headings[a] - headings[b])) < least) return true;
      }
    }
    return false;
  };
  const auto set = [&](Plan& plan, double leave, double arrive) {
    plan.leave = leave;
    plan.arrive = arrive;
    arm_of(plan, true) = leave;
    arm_of(plan, false) = arrive + kPiD;
  };
  std::vector<double> straight;
  for (Plan& plan : plans_) {
    const Node& from = nodes_[static_cast<size_t>(plan.from)];
    const Node& to = nodes_[static_cast<size_t>(plan.to)];
    straight.push_back(std::atan2(to.y - from.y, to.x - from.x));
    set(plan, straight.back(), straight.back());
  }
  for (size_t i = 0; i < plans_.size(); ++i) {
    RandomStream stream = draw(4, static_cast<uint32_t>(i));
    const float kind = stream.uniform();
    double angle = (stream.below(2) ? 1 : -1) * stream.uniform(0.16f, 0.4f);
    constexpr float kStraightShare = 0.4f, kArcShare = 0.35f;  // the rest are S-curves
    if (kind < kStraightShare) continue;
    const double arrive_sign = kind < kStraightShare + kArcShare ? -1 : 1;
    for (;; angle *= 0.7) {
      if (std::abs(angle) < 0.05) angle = 0;
      set(plans_[i], straight[i] + angle, straight[i] + arrive_sign * angle);
      if (angle == 0) break;
      if (!crowded(plans_[i].from) && !crowded(plans_[i].to) && !bends_too_much(plans_[i])) break;
    }
  }
}

Road& Town::add_road(const std::string& name, int junction, Curve curve) {
  Road added;
  added.id = static_cast<int>(roads_.size());
  added.name = name;
  added.junction = junction;
  added.curve = std::move(curve);
  roads_.push_back(std::move(added));
  return roads_.back();
}

void Town::lay_streets() {
  for (size_t i = 0; i < plans_.size(); ++i) {
    const Plan& plan = plans_[i];
    Node& from = nodes_[static_cast<size_t>(plan.from)];
    Node& to = nodes_[static_cast<size_t>(plan.to)];
    const Pose start = ahead({from.x, from.y, plan.leave}, mouth_distance(plan.from));
    const Pose end = ahead({to.x, to.y, plan.arrive}, -mouth_distance(plan.to));
    Road& street = add_road(fmt::format("{} {}", plan.avenue ? "Avenue" : "Street", i), -1, biarc(start, end));
    street.speed_mph = plan.avenue ? kAvenueSpeed_mph : kStreetSpeed_mph;
    RandomStream stream = draw(5, static_cast<uint32_t>(i));
    const int lanes = plan.avenue ? 2 : 1;
    const bool may_park = !plan.avenue && street.length() >= kMinParkingStreet_m;
    street.left = make_side(lanes, may_park && stream.below(2) == 1, true);
    street.right = make_side(lanes, may_park && stream.below(2) == 1, true);
    from.arms[static_cast<size_t>(plan.direction)] = {street.id, true, start};
    to.arms[static_cast<size_t>(plan.direction + 2)] = {street.id, false, turned_back(end)};
  }
}

/// Id of the lane of that kind on which traffic comes in from an arm (or goes out by it); 0 where there is none.
int Town::arm_lane(const Arm& arm, LaneKind kind, bool incoming) const {
  const bool on_right = arm.at_start != incoming;
  const Road& street = road(arm.street);
  return on_right ? -rank_of(street.right, kind) : rank_of(street.left, kind);
}

void Town::lay_bend(const Node& node) {
  std::vector<const Arm*> arms;
  for (const Arm& arm : node.arms) {
    if (arm.exists()) arms.push_back(&arm);
  }
  const Arm &from = *arms[0], &to = *arms[1];
  Road& bend = add_road(fmt::format("Bend {}", roads_.size()), -1, fillet(turned_back(from.mouth), to.mouth, 1));
  bend.speed_mph = kJunctionSpeed_mph;
  bend.left = bend.right = make_side(road(from.street).driving_lanes(), false, true);
  for (TownLane& lane : bend.right) {
    lane.predecessor = arm_lane(from, lane.kind, true);
    lane.successor = arm_lane(to, lane.kind, false);
  }
  for (TownLane& lane : bend.left) {
    lane.predecessor = arm_lane(from, lane.kind, false);
    lane.successor = arm_lane(to, lane.kind, true);
  }
  bend.predecessor = {false, from.street, from.at_start};
  bend.successor = {false, to.street, to.at_start};
  for (const bool at_bend_start : {true, false}) {
    const Arm& arm = at_bend_start ? from : to;
    Road& street = road(arm.street);
    (arm.at_start ? street.predecessor : street.successor) = {false, bend.id, at_bend_start};
    for (const bool right : {true, false}) {
      for (TownLane& lane : right ? street.right : street.left) {
        const bool bend_right = right == (arm.at_start != at_bend_start);
        const int rank = rank_of(bend_right ? bend.right : bend.left, lane.kind);
        (arm.at_start ? lane.predecessor : lane.successor) = bend_right ? -rank : rank;
      }
    }
  }
}

void Town::lay_junction(uint32_t node_index) {
  const Node& node = nodes_[node_index];
  TownJunction junction;
  junction.id = next_id_++;
  const bool far_side = draw(6, node_index).below(2) == 1;
  std::array<std::array<int, kNumDirections>, kNumDirections> connecting;  // [from][to] road, -1 none
  for (auto& row : connecting) row.fill(-1);

  for (size_t a = 0; a < kNumDirections; ++a) {
    const Arm& from = node.arms[a];
    if (!from.exists()) continue;
    Road& street = road(from.street);
    (from.at_start ? street.predecessor : street.successor) = {true, junction.id, false};
    size_t next_arm = (a + 1) % kNumDirections;  // the one that traffic from here has on its right
    while (!node.arms[next_arm].exists()) next_arm = (next_arm + 1) % kNumDirections;
    bool has_crosswalk = false;
    for (const size_t turn : {size_t{2}, size_t{3}, size_t{1}}) {  // straight on, left, right
      const size_t b = (a + turn) % kNumDirections;
      const Arm& to = node.arms[b];
      if (!to.exists()) continue;
      const int in_lanes = road(from.street).driving_lanes(), out_lanes = road(to.street).driving_lanes();
      // Inner lanes go straight on and left, outer ones straight on and right.
      const int first_in = turn == 1 ? in_lanes - 1 : 0, first_out = turn == 1 ? out_lanes - 1 : 0;
      const int lanes = turn == 2 ? in_lanes : 1;
      const Pose start = to_the_right(turned_back(from.mouth), first_in * kLaneWidth_m);
      const Pose end = to_the_right(to.mouth, first_out * kLaneWidth_m);
      Road& connection =
          add_road(fmt::format("Junction {} road {}", node_index, roads_.size()), junction.id,
                   turn == 2 ? biarc(start, end) : fillet(start, end, first_in == first_out ? 1 : kTightTurn));
      connecting[a][b] = connection.id;
      connection.speed_mph = turn == 2 ? road(from.street).speed_mph : kJunctionSpeed_mph;
      connection.predecessor = {false, from.street, from.at_start};
      connection.successor = {false, to.street, to.at_start};
      connection.right = make_side(lanes, false, b == next_arm);
      JunctionConnection links{from.street, connection.id, {}};
      for (size_t i = 0; i < connection.right.size(); ++i) {
        TownLane& lane = connection.right[i];
        const auto as_driving = [&](int rank) { return rank ? LaneKind::outer_driving : LaneKind::inner_driving; };
        const bool driving = static_cast<int>(i) < lanes;
        lane.predecessor = arm_lane(from, driving ? as_driving(first_in + static_cast<int>(i)) : lane.kind, true);
        lane.successor = arm_lane(to, driving ? as_driving(first_out + static_cast<int>(i)) : lane.kind, false);
        links.lane_links.emplace_back(lane.predecessor, -static_cast<int>(i) - 1);
      }
      junction.connections.push_back(std::move(links));
      if (!has_crosswalk && turn != 1) {
        connection.crosswalk_half_width = in_lanes * kLaneWidth_m + kShoulderWidth_m;
        connection.crosswalk_id = next_id_++;
        has_crosswalk = true;
      }
    }
  }

  // One light, one controller and one phase per approach.
  for (size_t a = 0; a < kNumDirections; ++a) {
    const Arm& from = node.arms[a];
    if (!from.exists()) continue;
    Signal signal;
    signal.id = next_id_++;
    const auto behind_kerb = [&](int street) {
      return road(street).driving_lanes() * kLaneWidth_m + kShoulderWidth_m + kPostSetback_m;
    };
    const int straight_on = connecting[a][(a + 2) % kNumDirections];
    Road* carrier = nullptr;
    if (!far_side) {
      carrier = &road(from.street);
      signal.for_forward_traffic = !from.at_start;
      signal.s = from.at_start ? 1.0 : carrier->length() - 1.0;
      signal.t = from.at_start ? behind_kerb(from.street) : -behind_kerb(from.street);
    } else if (straight_on >= 0) {
      carrier = &road(straight_on);
      signal.s = carrier->length();
      signal.t = -behind_kerb(node.arms[(a + 2) % kNumDirections].street);
    } else {
      // The stem of a T: on the pavement across, beside those who come from the right.
      carrier = &road(connecting[(a + 1) % kNumDirections][(a + 3) % kNumDirections]);
      signal.s = 0.5 * carrier->length();
      signal.t = -behind_kerb(node.arms[(a + 1) % kNumDirections].street);
      signal.heading_offset = -0.5 * kPiD;
    }
    carrier->signals.push_back(signal);
    for (size_t b = 0; b < kNumDirections; ++b) {
      if (connecting[a][b] < 0) continue;
      Road& connection = road(connecting[a][b]);
      connection.references.push_back({signal.id, connection.driving_lanes()});
    }
    const Controller controller{next_id_++, signal.id, static_cast<int>(junction.controllers.size())};
    controllers_.push_back(controller);
    junction.controllers.push_back(controller.id);
  }
  junctions_.push_back(std::move(junction));
}

// ---- writing

std::string number(double value) {
  std::string text = fmt::format("{:.10f}", value);
  return text == "-0.0000000000" ? text.substr(1) : text;
}

pugi::xml_node add(pugi::xml_node parent, const char* name,
                   std::initializer_list<std::pair<const char*, std::string>> attributes = {}) {
  pugi::xml_node node = parent.append_child(name);
  for (const auto& [key, value] : attributes) node.append_attribute(key).set_value(value.c_str());
  return node;
}

void add_cubic(pugi::xml_node parent, const char* name, const char* offset_name, double offset,
               std::array<double, 4> coefficients = {}) {
  add(parent, name,
      {{offset_name, number(offset)},
       {"a", number(coefficients[0])},
       {"b", number(coefficients[1])},
       {"c", number(coefficients[2])},
       {"d", number(coefficients[3])}});
}

void add_joint(pugi::xml_node link, const char* name, const Joint& joint) {
  if (joint.is_junction) {
    add(link, name, {{"elementType", "junction"}, {"elementId", fmt::to_string(joint.id)}});
  } else if (joint.id >= 0) {
    add(link, name,
        {{"elementType", "road"},
         {"elementId", fmt::to_string(joint.id)},
         {"contactPoint", joint.at_start ? "start" : "end"}});
  }
}

const char* type_name(LaneKind kind) {
  switch (kind) {
    case LaneKind::parking: return "parking";
    case LaneKind::shoulder: return "shoulder";
    case LaneKind::sidewalk: return "sidewalk";
    default: return "driving";
  }
}

void add_widths(pugi::xml_node lane, LaneKind kind, double road_length) {
  switch (kind) {
    case LaneKind::parking: {
      // A smooth step from 0 to the full width and back.
      const double w = kParkingWidth_m, l = kParkingTaper_m;
      const std::array<double, 4> opening{0, 0, 3 * w / (l * l), -2 * w / (l * l * l)};
      const std::array<double, 4> closing{w, 0, -3 * w / (l * l), 2 * w / (l * l * l)};
      add_cubic(lane, "width", "sOffset", 0);
      add_cubic(lane, "width", "sOffset", kParkingLead_m, opening);
      add_cubic(lane, "width", "sOffset", kParkingLead_m + l, {w, 0, 0, 0});
      add_cubic(lane, "width", "sOffset", road_length - kParkingLead_m - l, closing);
      add_cubic(lane, "width", "sOffset", road_length - kParkingLead_m);
      return;
    }
    case LaneKind::shoulder: return add_cubic(lane, "width", "sOffset", 0, {kShoulderWidth_m, 0, 0, 0});
    case LaneKind::sidewalk: return add_cubic(lane, "width", "sOffset", 0, {kSidewalkWidth_m, 0, 0, 0});
    default: return add_cubic(lane, "width", "sOffset", 0, {kLaneWidth_m, 0, 0, 0});
  }
}

void add_mark(pugi::xml_node lane, const char* type, const char* color = "white", bool change = false) {
  pugi::xml_node mark = add(lane, "roadMark",
                            {{"sOffset", number(0)},
                             {"type", type},
                             {"weight", "standard"},
                             {"color", color},
                             {"material", "standard"},
                             {"laneChange", change ? "both" : "none"}});
  if (std::string_view(type) != "none") mark.append_attribute("width").set_value("0.12");
}

/// The line on a lane's outer border.
void add_outer_mark(pugi::xml_node node, const Road& road, const Side& side, size_t index) {
  const bool between_driving = index + 1 < side.size() && side[index + 1].kind == LaneKind::outer_driving;
  const LaneKind kind = side[index].kind;
  if (kind == LaneKind::shoulder) return add_mark(node, "curb");
  if (road.junction >= 0 || kind == LaneKind::parking || kind == LaneKind::sidewalk) return add_mark(node, "none");
  add_mark(node, between_driving ? "broken" : "solid", "white", between_driving);
}

void add_side(pugi::xml_node section, const Road& road, bool left) {
  const Side& side = left ? road.left : road.right;
  if (side.empty()) return;
  const pugi::xml_node parent = add(section, left ? "left" : "right");
  for (size_t n = 0; n < side.size(); ++n) {
    const size_t i = left ? side.size() - 1 - n : n;  // the standard lists lanes from left to right
    const int id = (left ? 1 : -1) * static_cast<int>(i + 1);
    pugi::xml_node lane =
        add(parent, "lane", {{"id", fmt::to_string(id)}, {"type", type_name(side[i].kind)}, {"level", "false"}});
    const pugi::xml_node link = add(lane, "link");
    if (side[i].predecessor) add(link, "predecessor", {{"id", fmt::to_string(side[i].predecessor)}});
    if (side[i].successor) add(link, "successor", {{"id", fmt::to_string(side[i].successor)}});
    add_widths(lane, side[i].kind, road.length());
    add_outer_mark(lane, road, side, i);
  }
}

void add_signals(pugi::xml_node node, const Road& road) {
  const pugi::xml_node signals = add(node, "signals");
  for (const Signal& signal : road.signals) {
    const pugi::xml_node element = add(signals, "signal",
                                       {{"s", number(signal.s)},
                                        {"t", number(signal.t)},
                                        {"id", fmt::to_string(signal.id)},
                                        {"name", "Signal_3Light_Post01"},
                                        {"dynamic", "yes"},
                                        {"orientation", signal.for_forward_traffic ? "+" : "-"},
                                        {"zOffset", number(0)},
                                        {"country", "OpenDRIVE"},
                                        {"type", "1000001"},
                                        {"subtype", "-1"},
                                        {"value", "-1"},
                                        {"text", ""},
                                        {"height", "1.16"},
                                        {"width", "0.52"},
                                        {"hOffset", number(signal.heading_offset)},
                                        {"pitch", number(0)},
                                        {"roll", number(0)}});
    // What a light holds stands at its references on the connecting roads.
    add(element, "validity", {{"fromLane", "0"}, {"toLane", "0"}});
  }
  for (const SignalReference& reference : road.references) {
    const pugi::xml_node element =
        add(signals, "signalReference",
            {{"s", number(0)}, {"t", number(0)}, {"id", fmt::to_string(reference.id)}, {"orientation", "+"}});
    add(element, "validity", {{"fromLane", fmt::to_string(-reference.lanes)}, {"toLane", "-1"}});
  }
}

void add_crosswalk(pugi::xml_node node, const Road& road) {
  const double half = road.crosswalk_half_width;
  const pugi::xml_node object = add(add(node, "objects"), "object",
                                    {{"type", "crosswalk"},
                                     {"name", "Crosswalk"},
                                     {"id", fmt::to_string(road.crosswalk_id)},
                                     {"s", number(0)},
                                     {"t", number(0)},
                                     {"zOffset", number(0)},
                                     {"orientation", "none"},
                                     {"length", number(kCrosswalkEnd_m - kCrosswalkBegin_m)},
                                     {"width", number(2 * half)},
                                     {"hdg", number(0)},
                                     {"pitch", number(0)},
                                     {"roll", number(0)}});
  const pugi::xml_node outline = add(object, "outline");
  constexpr double u0 = kCrosswalkBegin_m, u1 = kCrosswalkEnd_m;
  for (const auto& [u, v] :
       {std::pair{u0, -half}, std::pair{u1, -half}, std::pair{u1, half}, std::pair{u0, half}, std::pair{u0, -half}}) {
    add(outline, "cornerLocal", {{"u", number(u)}, {"v", number(v)}, {"z", number(0)}, {"height", number(0)}});
  }
}

void add_road_element(pugi::xml_node root, const Road& road) {
  const pugi::xml_node node = add(root, "road",
                                  {{"name", road.name},
                                   {"length", number(road.length())},
                                   {"id", fmt::to_string(road.id)},
                                   {"junction", fmt::to_string(road.junction)}});
  const pugi::xml_node link = add(node, "link");
  add_joint(link, "predecessor", road.predecessor);
  add_joint(link, "successor", road.successor);
  const pugi::xml_node type = add(node, "type", {{"s", number(0)}, {"type", "town"}});
  add(type, "speed", {{"max", fmt::to_string(road.speed_mph)}, {"unit", "mph"}});
  const pugi::xml_node plan = add(node, "planView");
  double s = 0;
  for (const Piece& piece : road.curve) {
    const pugi::xml_node geometry = add(plan, "geometry",
                                        {{"s", number(s)},
                                         {"x", number(piece.start.x)},
                                         {"y", number(piece.start.y)},
                                         {"hdg", fmt::format("{:.14f}", wrapped(piece.start.heading))},
                                         {"length", number(piece.length)}});
    if (piece.curvature == 0) {
      add(geometry, "line");
    } else {
      add(geometry, "arc", {{"curvature", fmt::format("{:.14f}", piece.curvature)}});
    }
    s += piece.length;
  }
  add_cubic(add(node, "elevationProfile"), "elevation", "s", 0);
  const pugi::xml_node lanes = add(node, "lanes");
  add_cubic(lanes, "laneOffset", "s", 0);
  const pugi::xml_node section = add(lanes, "laneSection", {{"s", number(0)}});
  add_side(section, road, true);
  const pugi::xml_node center =
      add(add(section, "center"), "lane", {{"id", "0"}, {"type", "none"}, {"level", "false"}});
  add_mark(center, road.junction >= 0 ? "none" : (road.driving_lanes() == 2 ? "solid solid" : "broken"), "yellow");
  add_side(section, road, false);
  if (road.crosswalk_half_width > 0) add_crosswalk(node, road);
  if (!road.signals.empty() || !road.references.empty()) add_signals(node, road);
}

std::string Town::xml() const {
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version").set_value("1.0");
  declaration.append_attribute("encoding").set_value("UTF-8");
  pugi::xml_node root = document.append_child("OpenDRIVE");
  double west = nodes_[0].x, east = west, south = nodes_[0].y, north = south;
  for (const Node& node : nodes_) {
    west = std::min(west, node.x);
    east = std::max(east, node.x);
    south = std::min(south, node.y);
    north = std::max(north, node.y);
  }
  add(root, "header",
      {{"revMajor", "1"},
       {"revMinor", "4"},
       {"name", fmt::format("procedural:{}", seed_)},
       {"version", "1"},
       {"north", number(north)},
       {"south", number(south)},
       {"east", number(east)},
       {"west", number(west)},
       {"vendor", "pictura"}});
  for (const Road& each : roads_) add_road_element(root, each);
  for (const Controller& controller : controllers_) {
    const pugi::xml_node node = add(root, "controller",
                                    {{"name", fmt::format("Controller {}", controller.id)},
                                     {"id", fmt::to_string(controller.id)},
                                     {"sequence", fmt::to_string(controller.phase)}});
    add(node, "control", {{"signalId", fmt::to_string(controller.signal)}, {"type", ""}});
  }
  for (const TownJunction& junction : junctions_) {
    const pugi::xml_node node = add(
        root, "junction",
        {{"id", fmt::to_string(junction.id)}, {"name", fmt::format("Junction {}", junction.id)}, {"type", "default"}});
    for (size_t i = 0; i < junction.connections.size(); ++i) {
      const JunctionConnection& connection = junction.connections[i];
      const pugi::xml_node element = add(node, "connection",
                                         {{"id", fmt::to_string(i)},
                                          {"incomingRoad", fmt::to_string(connection.incoming_road)},
                                          {"connectingRoad", fmt::to_string(connection.connecting_road)},
                                          {"contactPoint", "start"}});
      for (const auto& [from, to] : connection.lane_links) {
        add(element, "laneLink", {{"from", fmt::to_string(from)}, {"to", fmt::to_string(to)}});
      }
    }
    for (size_t phase = 0; phase < junction.controllers.size(); ++phase) {
      add(node, "controller",
          {{"id", fmt::to_string(junction.controllers[phase])}, {"type", "0"}, {"sequence", fmt::to_string(phase)}});
    }
  }
  std::ostringstream out;
  document.save(out, " ");
  return out.str();
}

}  // namespace

std::string procedural_town(const TownOptions& options) {
  if (options.blocks_x < 1 || options.blocks_x > kMaxBlocks || options.blocks_y < 1 || options.blocks_y > kMaxBlocks) {
    fail_usage("procedural town: expected 1 to {} blocks each way, got {} x {}", kMaxBlocks, options.blocks_x,
               options.blocks_y);
  }
  return Town(options).xml();
}

}  // namespace pictura
