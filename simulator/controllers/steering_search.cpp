#include "pictura/simulator/controllers/steering_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <unordered_set>

namespace pictura {

namespace {

constexpr int kStrides = 30;

struct Node {
  Motion motion;
  size_t place = 0;
  float aside_m = 0;  // to the left of the path
  float cost = 0;
  int stride = 0;
  bool is_out = false;  // whether the agent has left through an exit
  size_t parent = 0;
  std::array<int32_t, kStrideSteps> actions{};
};

/// Key of a node. Nodes with the same key are similar, and only the cheapest of them is expanded.
uint64_t key_of(const Node& node) {
  constexpr float kAlike_m = 0.15f, kAlike_rad = 0.06f;
  const auto cell = [](float value, float size) {
    return static_cast<uint64_t>(static_cast<int64_t>(std::floor(value / size)) & 0xfff);
  };
  return cell(node.aside_m, kAlike_m) | cell(node.motion.heading_rad, kAlike_rad) << 12 |
         cell(node.motion.steer_rad, kAlike_rad) << 24 | static_cast<uint64_t>(node.place & 0xfffff) << 36 |
         static_cast<uint64_t>(node.stride) << 56;
}

class Search {
 public:
  Search(const DrivenAgent& agent, const std::vector<PathPoint>& path) : agent_(agent), path_(path) {}

  DrivingPlan from(const Node& start, size_t max_nodes) {
    size_t farthest = 0;
    open(start);
    while (!queue_.empty() && !is_clear(nodes_[farthest]) && nodes_.size() < max_nodes) {
      const size_t index = queue_.top().second;
      queue_.pop();
      if (!closed_.insert(key_of(nodes_[index])).second) continue;
      if (nodes_[index].stride > nodes_[farthest].stride || nodes_[index].is_out) farthest = index;
      expand(index);
    }
    return plan_to(farthest);
  }
  size_t num_nodes() const { return nodes_.size(); }

 private:
  using Entry = std::pair<float, size_t>;  // cost, node

  static bool is_clear(const Node& node) { return node.stride == kStrides || node.is_out; }

  void open(const Node& node) {
    if (closed_.count(key_of(node)) != 0) return;
    queue_.emplace(node.cost, nodes_.size());
    nodes_.push_back(node);
  }

  /// Adds the successors of a node. They differ in the lateral jerk of the next kStrideSteps steps: none, or left or
  /// right in the first step or in all steps.
  void expand(size_t index) {
    for (const auto& [side, steps] :
         {std::pair<int32_t, size_t>{0, 0}, {-1, 1}, {1, 1}, {-1, kStrideSteps}, {1, kStrideSteps}}) {
      Node next = nodes_[index];
      next.parent = index;
      ++next.stride;
      bool stays = true;
      for (size_t step = 0; step < kStrideSteps && stays && !next.is_out; ++step) {
        const float wanted_mps = std::min(kPlannedSpeed_mps, path_[next.place].speed_mps);
        next.actions[step] = agent_.speed_action(next.motion, wanted_mps) + (step < steps ? side : 0);
        stays = drive(next.actions[step], &next);
      }
      if (stays) open(next);
    }
  }

  /// Simulates a step. Returns false if the agent leaves the road or is too far from the path.
  bool drive(int32_t action, Node* node_inout) const {
    constexpr float kFarthestAside_m = 3, kMaxAskew_rad = 1.6f;
    constexpr float kMinMargin_m = 0.02f, kMargin_m = 0.2f, kTight = 3;
    Node& node = *node_inout;
    const Motion before = node.motion;
    node.motion = agent_.after(before, action);
    const Vec2 axle{node.motion.x_m, node.motion.y_m};
    node.place = nearest_point(path_, node.place, axle);
    const PathPoint& point = path_[node.place];
    const bool is_tight = agent_.leaves_road(node.motion, point.position_m.z, kMargin_m);
    if (is_tight && agent_.leaves_road(node.motion, point.position_m.z, kMinMargin_m)) return false;
    node.is_out = agent_.crosses_exit(before, node.motion, point.position_m.z);
    const SinCos way = sincos_of(point.heading_rad);
    node.aside_m = cross({way.cos, way.sin}, axle - point.position_m.xy());
    const float askew_rad = wrap_angle(node.motion.heading_rad - point.heading_rad);
    node.cost += driven_m(node.motion.speed_mps, agent_.dt_s()) *
                 (square(node.aside_m) + square(askew_rad) + (is_tight ? kTight : 0));
    return std::fabs(node.aside_m) < kFarthestAside_m && std::fabs(askew_rad) < kMaxAskew_rad;
  }

  DrivingPlan plan_to(size_t index) const {
    DrivingPlan plan;
    plan.is_clear = is_clear(nodes_[index]);
    plan.actions.resize(kStrideSteps * static_cast<size_t>(nodes_[index].stride));
    for (auto end = plan.actions.end(); end != plan.actions.begin(); index = nodes_[index].parent) {
      end = std::copy_backward(nodes_[index].actions.begin(), nodes_[index].actions.end(), end);
    }
    return plan;
  }

  const DrivenAgent& agent_;
  const std::vector<PathPoint>& path_;
  std::vector<Node> nodes_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
  std::unordered_set<uint64_t> closed_;
};

}  // namespace

DrivingPlan search_steering(const DrivenAgent& agent, const std::vector<PathPoint>& path, size_t place,
                            size_t* nodes_left_inout) {
  Node start;
  start.motion = agent.now();
  start.place = place;
  Search search(agent, path);
  DrivingPlan plan = search.from(start, *nodes_left_inout);
  *nodes_left_inout -= std::min(search.num_nodes(), *nodes_left_inout);
  return plan;
}

}  // namespace pictura
