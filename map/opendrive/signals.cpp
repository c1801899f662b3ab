// Junctions, traffic lights and signs. A light names lanes of a connecting road, or of the road that leads to the
// junction; everything else follows from the lane graph: where the junction's lanes begin is the stop line, what leads
// into them waits there, and the light faces it.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "pictura/map/opendrive/build.h"

namespace pictura::opendrive {

namespace {

constexpr std::string_view kLightType = "1000001";
// Heads hang this high over the foot of their post. The file does not say; posts beyond the junction carry a mast arm.
constexpr double kNearHeadHeight_m = 3.5, kFarHeadHeight_m = 5.5;
// A head further behind the stop line than this hangs on the far side.
constexpr float kFarHead_m = 5.0f;

struct SignalPlace {
  std::size_t road = 0;
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

class SignalBuilder {
 public:
  explicit SignalBuilder(Build* build) : build_(*build), map_(*build->map) {}

  void run() {
    for (const FileJunction& junction : build_.network.junctions) {
      map_.junctions.push_back({junction.id, 0});
      map_.provenance.junctions.push_back({-1, junction.where.line()});
    }
    find_signals();
    find_phases();
    held_.resize(ranked_.size());
    std::vector<bool> is_referenced(ranked_.size(), false);
    for (std::size_t road = 0; road < build_.network.roads.size(); ++road) {
      for (const SignalReference& reference : build_.network.roads[road].signal_references) {
        build_.faults->attempt([&] {
          const auto signal = signals_.find(reference.signal);
          if (signal == signals_.end()) {
            reference.where.fail("refers to signal {}, which does not exist", reference.signal);
          }
          is_referenced[signal->second] = true;
          collect(signal->second, road, reference.s, reference.orientation, reference.validity);
        });
      }
    }
    for (std::size_t rank = 0; rank < ranked_.size(); ++rank) {
      const FileSignal& signal = *ranked_[rank].signal;
      if (!is_referenced[rank]) collect(rank, ranked_[rank].road, signal.s, signal.orientation, signal.validity);
      sort_unique(&held_[rank]);
      if (signal.type != kLightType) {
        add_sign(rank);
      } else if (phases_.contains(signal.id)) {
        for (const int32_t lane : held_[rank]) hold(rank, lane);
      }
    }
    for (auto& [key, approach] : approaches_) add_light(key.first, &approach);
  }

 private:
  /// Signals in the order of the file's roads; keyed by (rank of the signal, approach road).
  using Key = std::pair<std::size_t, int32_t>;

  void find_signals() {
    for (std::size_t road = 0; road < build_.network.roads.size(); ++road) {
      for (const FileSignal& signal : build_.network.roads[road].signals) {
        build_.faults->attempt([&] {
          if (!signals_.emplace(signal.id, ranked_.size()).second) {
            signal.where.fail("attribute id: another signal has {} already", signal.id);
          }
          ranked_.push_back({road, &signal});
        });
      }
    }
  }

  /// Controllers by id, each with those of its signals that exist.
  std::unordered_map<std::string, FileController> sound_controllers() {
    std::unordered_map<std::string, FileController> controllers;
    for (const FileController& controller : build_.network.controllers) {
      build_.faults->attempt([&] {
        FileController sound = controller;
        sound.signals.clear();
        for (const std::string& signal : controller.signals) {
          build_.faults->attempt([&] {
            if (!signals_.contains(signal)) controller.where.fail("controls signal {}, which does not exist", signal);
            sound.signals.push_back(signal);
          });
        }
        if (!controllers.emplace(controller.id, std::move(sound)).second) {
          controller.where.fail("attribute id: another controller has it already");
        }
      });
    }
    return controllers;
  }

  /// Phases are the ranks of the sequence numbers of a junction's controllers, of those that control a light.
  void find_phases() {
    const std::unordered_map<std::string, FileController> controllers = sound_controllers();
    for (std::size_t j = 0; j < build_.network.junctions.size(); ++j) {
      std::map<int, std::vector<std::string>> lights_of_sequence;
      for (const std::string& id : build_.network.junctions[j].controllers) {
        build_.faults->attempt([&] {
          const auto controller = controllers.find(id);
          if (controller == controllers.end()) {
            build_.network.junctions[j].where.fail("refers to controller {}, which does not exist", id);
          }
          for (const std::string& signal : controller->second.signals) {
            if (ranked_[signals_.at(signal)].signal->type != kLightType) continue;
            lights_of_sequence[controller->second.sequence].push_back(signal);
          }
        });
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

  /// Adds the lanes at s of a road for which a signal holds: those of its validity, or all of its orientation.
  void collect(std::size_t rank, std::size_t road, double s, Orientation orientation,
               const std::vector<LaneRange>& validity) {
    const FileRoad& file_road = build_.network.roads[road];
    // References are often placed mid-road; lanes have the ids of the section there.
    std::size_t section = file_road.sections.size() - 1;
    while (section > 0 && file_road.sections[section].s > s) --section;
    for (const std::vector<FileLane>* side : {&file_road.sections[section].left, &file_road.sections[section].right}) {
      for (const FileLane& candidate : *side) {
        const int32_t index = build_.lanes[road][section].of(candidate.id);
        if (index < 0 || candidate.type != LaneType::driving) continue;
        const bool is_valid = validity.empty()
                                  ? orientation == Orientation::either ||
                                        (orientation == Orientation::along) == travels_forward(file_road, candidate)
                                  : std::any_of(validity.begin(), validity.end(), [&](const LaneRange& range) {
                                      return candidate.id >= std::min(range.from, range.to) &&
                                             candidate.id <= std::max(range.from, range.to);
                                    });
        if (is_valid) held_[rank].push_back(index);
      }
    }
  }

  /// The lanes of the same road before (or behind) this one, and this one, nearest first.
  std::vector<int32_t> along_road(int32_t from, IndexRange Lane::* onward) const {
    std::vector<int32_t> chain{from};
    for (bool more = true; more;) {
      more = false;
      for (const int32_t next : map_.links(lane(chain.back()).*onward)) {
        if (lane(next).source_road != lane(from).source_road) continue;
        if (std::find(chain.begin(), chain.end(), next) != chain.end()) continue;
        chain.push_back(next);
        more = true;
        break;
      }
    }
    return chain;
  }

  /// A lane of a junction is followed back to where it begins: the lanes that lead there wait for the signal. A lane
  /// that leads to a junction is followed to its end, where it waits itself.
  void hold(std::size_t rank, int32_t held) {
    if (lane(held).in_junction) {
      const std::vector<int32_t> connecting = along_road(held, &Lane::predecessors);
      for (const int32_t incoming : map_.links(lane(connecting.back()).predecessors)) {
        if (is_drivable(lane(incoming).type)) add_approach(rank, incoming, connecting);
      }
      return;
    }
    const int32_t incoming = along_road(held, &Lane::successors).back();
    std::vector<int32_t> connecting;
    for (const int32_t next : map_.links(lane(incoming).successors)) {
      if (lane(next).in_junction) connecting.push_back(next);
    }
    if (!connecting.empty()) add_approach(rank, incoming, connecting);
  }

  void add_approach(std::size_t rank, int32_t incoming, const std::vector<int32_t>& connecting) {
    Approach& approach = approaches_[{rank, lane(incoming).source_road}];
    approach.incoming.push_back(incoming);
    approach.connecting.insert(approach.connecting.end(), connecting.begin(), connecting.end());
  }

  Point3 place_of(std::size_t rank) const {
    const FileSignal& signal = *ranked_[rank].signal;
    Point3 place = point_at(build_.network.roads[ranked_[rank].road], signal.s, signal.t);
    place.z += signal.z_offset;
    return place;
  }

  void add_sign(std::size_t rank) {
    const FileSignal& signal = *ranked_[rank].signal;
    Sign sign{.name = signal.id, .type = signal.type, .subtype = signal.subtype, .country = signal.country};
    sign.position_m = build_.to_map(place_of(rank));
    // Orientations are unreliable where editors set them; the traffic of the lanes that it names is not.
    double heading = pose_at(build_.network.roads[ranked_[rank].road], signal.s).heading;
    if (signal.orientation == Orientation::against) heading += std::numbers::pi;
    if (!held_[rank].empty()) {
      const Span<const LanePoint> points = map_.points_of(lane(held_[rank].front()));
      heading = std::min_element(points.begin(), points.end(), [&](const LanePoint& a, const LanePoint& b) {
                  return length(a.position_m - sign.position_m) < length(b.position_m - sign.position_m);
                })->heading_rad;
    }
    sign.heading_rad = static_cast<float>(std::remainder(heading, 2 * std::numbers::pi));
    sign.lanes.begin = static_cast<int32_t>(map_.sign_lanes.size());
    map_.sign_lanes.insert(map_.sign_lanes.end(), held_[rank].begin(), held_[rank].end());
    sign.lanes.end = static_cast<int32_t>(map_.sign_lanes.size());
    map_.signs.push_back(sign);
    map_.provenance.signs.push_back(source_of(ranked_[rank].road, signal.where));
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

    Point3 head = place_of(rank);
    const Vec2 middle = (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f;
    const float ahead_m = -dot(build_.to_map(head).xy() - middle, light.head_facing);
    head.z += (ahead_m > kFarHead_m ? kFarHeadHeight_m : kNearHeadHeight_m);
    light.head_m = build_.to_map(head);

    light.lanes.begin = static_cast<int32_t>(map_.light_lanes.size());
    map_.light_lanes.insert(map_.light_lanes.end(), approach->incoming.begin(), approach->incoming.end());
    map_.light_lanes.insert(map_.light_lanes.end(), approach->connecting.begin(), approach->connecting.end());
    light.lanes.end = static_cast<int32_t>(map_.light_lanes.size());
    map_.lights.push_back(light);
    map_.provenance.lights.push_back(source_of(ranked_[rank].road, signal.where));
  }

  Build& build_;
  RoadMap& map_;
  std::vector<SignalPlace> ranked_;
  std::unordered_map<std::string, std::size_t> signals_;
  std::vector<std::vector<int32_t>> held_;  // [signals] lanes that references and validities name
  std::unordered_map<std::string, Phase> phases_;
  std::map<Key, Approach> approaches_;
};

}  // namespace

void build_signals(Build* build) { SignalBuilder(build).run(); }

}  // namespace pictura::opendrive
