#include "pictura/map/opendrive/deform.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "pictura/map/opendrive/curves.h"

namespace pictura::opendrive {

namespace {

// Reference lines of linked roads that are further apart do not belong together.
constexpr double kMaxOffset_m = 40.0;

/// Ends of roads, numbered 2 * road + (0: start, 1: end), in groups of linked ones.
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

  /// The ends that are linked with an end, itself included, in ascending order; [ends].
  std::vector<std::vector<std::size_t>> groups() {
    std::vector<std::vector<std::size_t>> of_root(parent_.size()), of_end;
    for (std::size_t end = 0; end < parent_.size(); ++end) of_root[root_of(end)].push_back(end);
    for (std::size_t end = 0; end < parent_.size(); ++end) of_end.push_back(of_root[root_of(end)]);
    return of_end;
  }

 private:
  std::size_t end_of(const std::string& road, ContactPoint contact) const {
    return 2 * static_cast<std::size_t>(network_.road_index.at(road)) + (contact == ContactPoint::end ? 1 : 0);
  }

  void join_link(std::size_t end, const RoadLink& link) {
    if (link.kind == RoadLink::Kind::road) join(end, end_of(link.id, link.contact));
  }

  void join(std::size_t a, std::size_t b) { parent_[root_of(a)] = root_of(b); }

  std::size_t root_of(std::size_t end) {
    while (parent_[end] != end) end = parent_[end] = parent_[parent_[end]];
    return end;
  }

  const Network& network_;
  std::vector<std::size_t> parent_;
};

/// Chooses the shift of each end, so that lanes of linked roads meet.
class ShiftSolver {
 public:
  ShiftSolver(const Eigen::Matrix2d& plan, const Network& network)
      : plan_(plan), network_(network), groups_(LinkedEnds(network).groups()), shifts_(groups_.size()) {
    for (const FileRoad& road : network.roads) {
      for (const double s : {0.0, road.length}) poses_.push_back(pose_at(road, s));
    }
  }

  /// [ends]
  std::vector<Eigen::Vector2d> solve() {
    // Roads outside junctions carry the shift that they begin with to their other end, however short they are.
    for (std::size_t road = 0; road < network_.roads.size(); ++road) {
      if (is_in_junction(2 * road) || shifts_[2 * road] || shifts_[2 * road + 1]) continue;
      shifts_[2 * road] = shifts_[2 * road + 1] = Eigen::Vector2d::Zero();
      std::vector<std::size_t> reached{2 * road, 2 * road + 1};
      while (!reached.empty()) {
        const std::size_t from = reached.back();
        reached.pop_back();
        for (const std::size_t end : groups_[from]) {
          if (is_in_junction(end) || shifts_[end]) continue;
          shifts_[end] = shift_beside(from, end);
          const std::size_t other = end ^ 1;
          if (!shifts_[other]) shifts_[other] = shifts_[end];
          reached.push_back(other);
        }
      }
    }
    // Those of junctions lead from road to road.
    std::vector<Eigen::Vector2d> all;
    for (std::size_t end = 0; end < groups_.size(); ++end) {
      const auto anchor = std::find_if(groups_[end].begin(), groups_[end].end(),
                                       [&](std::size_t other) { return !is_in_junction(other); });
      if (shifts_[end])
        all.push_back(*shifts_[end]);
      else
        all.push_back(shift_beside(anchor == groups_[end].end() ? groups_[end].front() : *anchor, end));
    }
    return all;
  }

 private:
  bool is_in_junction(std::size_t end) const { return !network_.roads[end / 2].junction.empty(); }

  /// The shift by which `end` keeps its distance to the left of `anchor`, in metres.
  Eigen::Vector2d shift_beside(std::size_t anchor, std::size_t end) const {
    const Pose& pose = poses_[anchor];
    const Eigen::Vector2d along{std::cos(pose.heading), std::sin(pose.heading)}, left{-along.y(), along.x()};
    const Eigen::Vector2d offset = poses_[end].position_m - pose.position_m;
    const Eigen::Vector2d shift = shifts_[anchor].value_or(Eigen::Vector2d::Zero());
    if (offset.norm() > kMaxOffset_m) return shift;
    const Eigen::Vector2d mapped = (plan_ * along).normalized(), mapped_left{-mapped.y(), mapped.x()};
    return shift + offset.dot(left) * (mapped_left - plan_ * left);
  }

  const Eigen::Matrix2d plan_;
  const Network& network_;
  std::vector<std::vector<std::size_t>> groups_;
  std::vector<std::optional<Eigen::Vector2d>> shifts_;
  std::vector<Pose> poses_;
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
