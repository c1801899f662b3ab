#include "pictura/map/opendrive/deform.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>

#include "pictura/map/opendrive/curves.h"

namespace pictura::opendrive {

namespace {

// Linked ends whose reference lines are farther apart than this distance get equal shifts.
constexpr double kMaxLinkOffset_m = 40.0;

/// Ends of roads, numbered 2 * road + (0: start, 1: end), in groups of linked ends.
class LinkedEnds {
 public:
  explicit LinkedEnds(const Network& network) : network_(network), parent_(2 * network.roads.size()) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (std::size_t road = 0; road < network.roads.size(); ++road) {
      join_link(2 * road, network.roads[road].predecessor);
      join_link(2 * road + 1, network.roads[road].successor);
    }
    for (const FileJunction& junction : network.junctions) {
      for (const Connection& connection : junction.connections) {
        join(end_of(connection.incoming_road, connection.incoming_end),
             end_of(connection.connecting_road, connection.contact));
      }
    }
  }

  std::size_t size() const { return parent_.size(); }

  /// Returns the representative of the ends that are linked with `end`.
  std::size_t group_of(std::size_t end) {
    while (parent_[end] != end) end = parent_[end] = parent_[parent_[end]];
    return end;
  }

 private:
  std::size_t end_of(const std::string& road, ContactPoint contact) const {
    return 2 * static_cast<std::size_t>(network_.road_index.at(road)) + (contact == ContactPoint::end ? 1 : 0);
  }

  void join_link(std::size_t end, const RoadLink& link) {
    if (link.kind == RoadLink::Kind::road) join(end, end_of(link.id, link.contact));
  }

  void join(std::size_t a, std::size_t b) { parent_[group_of(a)] = group_of(b); }

  const Network& network_;
  std::vector<std::size_t> parent_;
};

/// Chooses the shift of each end, so that lanes of linked roads meet.
class ShiftSolver {
 public:
  ShiftSolver(const Eigen::Matrix2d& plan, const Network& network)
      : plan_(plan), network_(network), ends_(network), members_(ends_.size()), shifts_(ends_.size()) {
    for (std::size_t end = 0; end < ends_.size(); ++end) members_[ends_.group_of(end)].push_back(end);
    for (const FileRoad& road : network.roads) {
      for (const double s : {0.0, road.length}) poses_.push_back(pose_at(road, s));
    }
  }

  /// Returns the shifts, as [ends].
  std::vector<Eigen::Vector2d> solve() {
    // A road outside junctions keeps the first shift that it gets. Then the roads that are linked with it get theirs.
    for (std::size_t road = 0; road < network_.roads.size(); ++road) {
      if (is_in_junction(2 * road)) continue;
      for (const std::size_t end : {2 * road, 2 * road + 1}) set_shift(end, Eigen::Vector2d::Zero());
      while (!reached_.empty()) {
        const std::size_t anchor = reached_.back();
        reached_.pop_back();
        for (const std::size_t end : take_members(anchor)) {
          if (!is_in_junction(end)) set_shift(end, shift_beside(anchor, end));
        }
      }
    }
    // The remaining groups contain only ends of junction roads. The first end of each of these groups is not shifted.
    for (std::size_t end = 0; end < ends_.size(); ++end) take_members(end);
    std::vector<Eigen::Vector2d> all;
    for (std::size_t end = 0; end < ends_.size(); ++end) {
      all.push_back(shifts_[end].value_or(shift_beside(anchors_.at(ends_.group_of(end)), end)));
    }
    return all;
  }

 private:
  bool is_in_junction(std::size_t end) const { return !network_.roads[end / 2].junction.empty(); }

  /// Sets the shift of an end, and of the road's other end if that has no shift yet. Does nothing if `end` has a shift.
  void set_shift(std::size_t end, const Eigen::Vector2d& shift_m) {
    for (const std::size_t each : {end, end ^ 1}) {
      if (shifts_[each]) return;
      shifts_[each] = shift_m;
      reached_.push_back(each);
    }
  }

  /// Returns the members of an end's group, and makes the end the group's anchor. Returns an empty list if the group
  /// already has an anchor.
  std::vector<std::size_t> take_members(std::size_t end) {
    const std::size_t group = ends_.group_of(end);
    anchors_.try_emplace(group, end);
    return std::exchange(members_[group], {});
  }

  /// Returns the shift with which `end` keeps its lateral distance in metres from `anchor`.
  Eigen::Vector2d shift_beside(std::size_t anchor, std::size_t end) const {
    const Pose& pose = poses_[anchor];
    const Eigen::Vector2d along{std::cos(pose.heading), std::sin(pose.heading)}, left{-along.y(), along.x()};
    const Eigen::Vector2d offset = poses_[end].position_m - pose.position_m;
    const Eigen::Vector2d shift = shifts_[anchor].value_or(Eigen::Vector2d::Zero());
    if (offset.norm() > kMaxLinkOffset_m) return shift;
    const Eigen::Vector2d mapped = (plan_ * along).normalized(), mapped_left{-mapped.y(), mapped.x()};
    return shift + offset.dot(left) * (mapped_left - plan_ * left);
  }

  const Eigen::Matrix2d plan_;
  const Network& network_;
  LinkedEnds ends_;
  std::vector<std::vector<std::size_t>> members_;         // [ends] groups, by their representative
  std::vector<std::optional<Eigen::Vector2d>> shifts_;    // [ends]
  std::unordered_map<std::size_t, std::size_t> anchors_;  // by group
  std::vector<Pose> poses_;                               // [ends] in the network before the deformation
  std::vector<std::size_t> reached_;                      // ends with shifts whose groups are not yet shifted
};

}  // namespace

void deform(const PlanMap& plan, Network* network) {
  const Eigen::Matrix2d matrix{{plan.xx, plan.xy}, {plan.yx, plan.yy}};
  const std::vector<Eigen::Vector2d> shifts = ShiftSolver(matrix, *network).solve();
  for (std::size_t road = 0; road < network->roads.size(); ++road) {
    const Eigen::Vector2d &start = shifts[2 * road], &end = shifts[2 * road + 1];
    network->roads[road].deformation = RoadDeformation{plan, {start.x(), start.y()}, {end.x(), end.y()}};
  }
}

}  // namespace pictura::opendrive
