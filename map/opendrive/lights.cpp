// Junctions and traffic lights. A signal reference names lanes of a connecting road; everything else follows from the
// lane graph: where those lanes begin is the stop line, what leads into them waits there, and the light faces it.
#include <algorithm>
#include <cmath>
#include <map>

#include "pictura/map/opendrive/build.h"

namespace pictura::opendrive {

namespace {

constexpr std::string_view kLightType = "1000001";
// Heads hang this high over the foot of their post. The file does not say; posts beyond the junction carry a mast arm.
constexpr double kNearHeadHeight_m = 3.5, kFarHeadHeight_m = 5.5;
// A head further behind the stop line than this hangs on the far side.
constexpr float kFarHead_m = 5.0f;
constexpr int kMaxLaneId = 64;

struct SignalPlace {
  const FileRoad* road = nullptr;
  const FileSignal* signal = nullptr;
};

/// The phase that a signal is green in, and where.
struct Phase {
  int32_t junction = -1, phase = 0;
};

/// What one signal holds on one approach road, lanes in ascending order.
struct Approach {
  std::vector<int32_t> incoming, connecting;
};

class LightBuilder {
 public:
  explicit LightBuilder(Build* build) : build_(*build), map_(*build->map) {}

  void run() {
    for (const FileJunction& junction : build_.network.junctions) map_.junctions.push_back({junction.id, 0});
    find_signals();
    find_phases();
    for (std::size_t road = 0; road < build_.network.roads.size(); ++road) {
      for (const SignalReference& reference : build_.network.roads[road].signal_references) {
        if (!signals_.contains(reference.signal)) {
          reference.where.fail("refers to signal {}, which does not exist", reference.signal);
        }
        if (phases_.contains(reference.signal)) collect(road, reference);
      }
    }
    for (auto& [key, approach] : approaches_) add_light(key.first, &approach);
  }

 private:
  /// Signals in the order of the file's roads; keyed by (rank of the signal, approach road).
  using Key = std::pair<std::size_t, int32_t>;

  void find_signals() {
    for (const FileRoad& road : build_.network.roads) {
      for (const FileSignal& signal : road.signals) {
        if (!signals_.emplace(signal.id, ranked_.size()).second) {
          signal.where.fail("attribute id: another signal has {} already", signal.id);
        }
        ranked_.push_back({&road, &signal});
      }
    }
  }

  /// Phases are the ranks of the sequence numbers of a junction's controllers, of those that control a light.
  void find_phases() {
    std::unordered_map<std::string, const FileController*> controllers;
    for (const FileController& controller : build_.network.controllers) {
      if (!controllers.emplace(controller.id, &controller).second) {
        controller.where.fail("attribute id: another controller has it already");
      }
      for (const std::string& signal : controller.signals) {
        if (!signals_.contains(signal)) controller.where.fail("controls signal {}, which does not exist", signal);
      }
    }
    for (std::size_t j = 0; j < build_.network.junctions.size(); ++j) {
      std::map<int, std::vector<std::string>> lights_of_sequence;
      for (const std::string& id : build_.network.junctions[j].controllers) {
        const auto controller = controllers.find(id);
        if (controller == controllers.end()) {
          build_.network.junctions[j].where.fail("refers to controller {}, which does not exist", id);
        }
        for (const std::string& signal : controller->second->signals) {
          if (ranked_[signals_.at(signal)].signal->type != kLightType) continue;
          lights_of_sequence[controller->second->sequence].push_back(signal);
        }
      }
      int32_t phase = 0;
      for (const auto& [sequence, lights] : lights_of_sequence) {
        for (const std::string& light : lights) phases_.emplace(light, Phase{static_cast<int32_t>(j), phase});
        ++phase;
      }
      map_.junctions[j].num_phases = phase;
    }
  }

  const Lane& lane(int32_t index) const { return map_.lanes[static_cast<std::size_t>(index)]; }

  const LanePoint& end_of(int32_t index) const {
    return map_.lane_points[static_cast<std::size_t>(lane(index).points.end) - 1];
  }

  void collect(std::size_t road, const SignalReference& reference) {
    const std::vector<FileSection>& sections = build_.network.roads[road].sections;
    // References are often placed mid-road; lanes have the ids of the section there, and are followed back from it.
    std::size_t section = sections.size() - 1;
    while (section > 0 && sections[section].s > reference.s) --section;
    const auto [low, high] = std::minmax(reference.from_lane, reference.to_lane);
    for (int id = std::max(low, -kMaxLaneId); id <= std::min(high, kMaxLaneId); ++id) {
      const int32_t referenced = build_.lanes[road][section].of(id);
      if (referenced < 0 || lane(referenced).type != LaneType::driving) continue;
      hold(signals_.at(reference.signal), referenced);
    }
  }

  /// Follows a lane back over its own road to where it begins; the lanes that lead there wait for the signal.
  void hold(std::size_t signal, int32_t referenced) {
    std::vector<int32_t> connecting{referenced};
    for (bool more = true; more;) {
      more = false;
      for (const int32_t before : map_.links(lane(connecting.back()).predecessors)) {
        if (lane(before).source_road != lane(referenced).source_road) continue;
        if (std::find(connecting.begin(), connecting.end(), before) != connecting.end()) continue;
        connecting.push_back(before);
        more = true;
        break;
      }
    }
    for (const int32_t incoming : map_.links(lane(connecting.back()).predecessors)) {
      if (!is_drivable(lane(incoming).type)) continue;
      Approach& approach = approaches_[{signal, lane(incoming).source_road}];
      approach.incoming.push_back(incoming);
      approach.connecting.insert(approach.connecting.end(), connecting.begin(), connecting.end());
    }
  }

  static void sort_unique(std::vector<int32_t>* lanes) {
    std::sort(lanes->begin(), lanes->end());
    lanes->erase(std::unique(lanes->begin(), lanes->end()), lanes->end());
  }

  void add_light(std::size_t rank, Approach* approach) {
    sort_unique(&approach->incoming);
    sort_unique(&approach->connecting);
    const FileSignal& signal = *ranked_[rank].signal;
    const Phase phase = phases_.at(signal.id);
    TrafficLight light;
    light.name = signal.id;
    light.junction = phase.junction;
    light.phase = phase.phase;

    // The stop line spans the ends of the incoming lanes, from the left of the leftmost to the right of the rightmost.
    float left_m = -1e30f, right_m = 1e30f;
    const LanePoint reference = end_of(approach->incoming.front());
    const SinCos direction = sincos_of(reference.heading_rad);
    const Vec2 left{-direction.sin, direction.cos};
    for (const int32_t incoming : approach->incoming) {
      const LanePoint end = end_of(incoming);
      const SinCos heading = sincos_of(end.heading_rad);
      const Vec2 half = Vec2{-heading.sin, heading.cos} * (0.5f * end.width_m);
      for (const float side : {1.0f, -1.0f}) {
        const Vec2 corner = end.position_m.xy() + half * side;
        const float lateral_m = dot(corner - reference.position_m.xy(), left);
        const Vec3 place{corner.x, corner.y, end.position_m.z};
        if (lateral_m > left_m) {
          left_m = lateral_m;
          light.stop_a_m = place;
        }
        if (lateral_m < right_m) {
          right_m = lateral_m;
          light.stop_b_m = place;
        }
      }
    }
    light.stop_heading_rad = reference.heading_rad;
    light.head_facing = Vec2{-direction.cos, -direction.sin};

    Point3 head = point_at(*ranked_[rank].road, signal.s, signal.t);
    const Vec2 middle = (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f;
    const float ahead_m = -dot(build_.to_map(head).xy() - middle, light.head_facing);
    head.z += signal.z_offset + (ahead_m > kFarHead_m ? kFarHeadHeight_m : kNearHeadHeight_m);
    light.head_m = build_.to_map(head);

    light.lanes.begin = static_cast<int32_t>(map_.light_lanes.size());
    map_.light_lanes.insert(map_.light_lanes.end(), approach->incoming.begin(), approach->incoming.end());
    map_.light_lanes.insert(map_.light_lanes.end(), approach->connecting.begin(), approach->connecting.end());
    light.lanes.end = static_cast<int32_t>(map_.light_lanes.size());
    map_.lights.push_back(light);
  }

  Build& build_;
  RoadMap& map_;
  std::vector<SignalPlace> ranked_;
  std::unordered_map<std::string, std::size_t> signals_;
  std::unordered_map<std::string, Phase> phases_;
  std::map<Key, Approach> approaches_;
};

}  // namespace

void build_lights(Build* build) { LightBuilder(build).run(); }

}  // namespace pictura::opendrive
