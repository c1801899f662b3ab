// Builds junctions, traffic lights and signs. A light of the file applies to lanes of a connecting road, or of the road
// that leads to the junction. The rest follows from the lane graph. The stop line is at the start of the junction's
// lanes, the predecessors of these lanes are the incoming lanes, and the light faces the traffic of the incoming lanes.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "pictura/map/light_phases.h"
#include "pictura/map/opendrive/build.h"
#include "pictura/map/opendrive/lights.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura::opendrive {

namespace {

// Heights of near and far heads above the foot of their post. Files do not contain these heights. A far head is assumed
// to hang on a mast arm.
constexpr double kNearHeadHeight_m = 3.5, kFarHeadHeight_m = 5.5;
// Minimum distance beyond the stop line of a far head.
constexpr float kFarHead_m = 5.0f;
constexpr float kMinStopLine_m = 0.1f;

struct PlacedSignal {
  std::size_t road = 0;
  const FileSignal* signal = nullptr;
};

/// Junction of a signal, and the signal's green phase.
struct Phase {
  int32_t junction = -1, phase = 0;
};

/// Lanes that one signal controls on one approach road, in ascending order.
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
    signal_lanes_.resize(placed_signals_.size());
    std::vector<bool> is_referenced(placed_signals_.size(), false);
    for (std::size_t road = 0; road < build_.network.roads.size(); ++road) {
      for (const SignalReference& reference : build_.network.roads[road].signal_references) {
        const auto signal = index_by_id_.find(reference.signal);
        if (signal == index_by_id_.end()) {
          reference.where.record_repair(build_.faults, RepairKind::missing_signal,
                                        "refers to signal {}, which does not exist", reference.signal);
          continue;
        }
        is_referenced[signal->second] = true;
        collect(signal->second, road, reference);
      }
    }
    for (std::size_t signal_index = 0; signal_index < placed_signals_.size(); ++signal_index) {
      build_.budget.work().check();
      const FileSignal& signal = *placed_signals_[signal_index].signal;
      if (!is_referenced[signal_index]) collect(signal_index, placed_signals_[signal_index].road, signal);
      sort_unique(&signal_lanes_[signal_index]);
      if (signal.type != kLightType) {
        add_sign(signal_index);
        continue;
      }
      const bool is_controlled = phases_.contains(signal.id);
      Approaches approaches = std::move(lone_approaches_[signal_index]);
      for (const int32_t lane : signal_lanes_[signal_index]) find_approaches(lane, &approaches);
      if (approaches.empty()) {
        signal.where.record_repair(build_.faults, RepairKind::laneless_light, "controls no lane with a stop line");
      } else if (is_controlled) {
        for (auto& [way, approach] : approaches) add_light(signal_index, phases_.at(signal.id), &approach);
      } else {
        add_uncontrolled(signal_index, approaches);
      }
    }
    add_uncontrolled_lights();
  }

 private:
  /// Approaches. The key is the index of the approach road, and whether its traffic travels towards growing s.
  using Approaches = std::map<std::pair<int32_t, bool>, Approach>;

  /// An approach without a controller. All heads of the approach share one stop line.
  struct UncontrolledLine {
    std::size_t signal_index = 0;  // index of the first head
    Approach approach;
  };

  void find_signals() {
    for (std::size_t road = 0; road < build_.network.roads.size(); ++road) {
      for (const FileSignal& signal : build_.network.roads[road].signals) {
        if (!index_by_id_.emplace(signal.id, placed_signals_.size()).second) {
          signal.where.record_repair(build_.faults, RepairKind::repeated_signal,
                                     "attribute id: another signal already has {}", signal.id);
        }
        placed_signals_.push_back({road, &signal});
      }
    }
  }

  /// Returns the controllers by id. References to signals that do not exist are removed.
  std::unordered_map<std::string, FileController> valid_controllers() {
    std::unordered_map<std::string, FileController> controllers;
    for (const FileController& controller : build_.network.controllers) {
      FileController valid = controller;
      std::erase_if(valid.signals, [&](const std::string& signal) {
        if (index_by_id_.contains(signal)) return false;
        controller.where.record_repair(build_.faults, RepairKind::missing_signal,
                                       "controls signal {}, which does not exist", signal);
        return true;
      });
      if (!controllers.emplace(controller.id, std::move(valid)).second) {
        controller.where.record_repair(build_.faults, RepairKind::repeated_controller,
                                       "attribute id: another controller already has it");
      }
    }
    return controllers;
  }

  /// Finds the phases of lights. A light's phase is the rank of its controller's sequence number among the controllers
  /// of lights of the junction.
  void find_phases() {
    const std::unordered_map<std::string, FileController> controllers = valid_controllers();
    for (std::size_t j = 0; j < build_.network.junctions.size(); ++j) {
      std::map<int, std::vector<std::string>> lights_of_sequence;
      for (const std::string& id : build_.network.junctions[j].controllers) {
        const auto controller = controllers.find(id);
        if (controller == controllers.end()) {
          build_.network.junctions[j].where.record_repair(build_.faults, RepairKind::missing_controller,
                                                          "refers to controller {}, which does not exist", id);
          continue;
        }
        for (const std::string& signal : controller->second.signals) {
          if (placed_signals_[index_by_id_.at(signal)].signal->type != kLightType) continue;
          lights_of_sequence[controller->second.sequence].push_back(signal);
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

  const Lane& lane(int32_t index) const { return map_.lanes[index]; }

  const LanePoint& end_of(int32_t index) const {
    return map_.lane_points[static_cast<std::size_t>(lane(index).points.end) - 1];
  }

  /// Adds the lanes of a road to which a signal (or a reference to it) applies: the lanes of its validity if it has
  /// one, else all lanes of its orientation. For a light away from junctions, the lanes that meet at its stop line form
  /// an approach.
  template <typename Signal>
  void collect(std::size_t signal_index, std::size_t road, const Signal& signal) {
    const FileRoad& file_road = build_.network.roads[road];
    // Lane ids refer to the section at the station of the signal or reference, because references are often in the
    // middle of a road.
    const FileSection& section = section_at(file_road, signal.stop_s.value_or(signal.s));
    const SectionLanes& lanes = build_.lanes[road][&section - file_road.sections.data()];
    for (const std::vector<FileLane>* side : {&section.left, &section.right}) {
      for (const FileLane& candidate : *side) {
        const int32_t index = lanes.of(candidate.id);
        if (index < 0 || candidate.type != LaneType::driving) continue;
        if (!applies_to(candidate, file_road, signal.orientation, signal.validity)) continue;
        if (!signal.stop_s) {
          signal_lanes_[signal_index].push_back(index);
        } else if ((*signal.stop_s - section.s < section.end - *signal.stop_s) ==
                   travels_forward(file_road, candidate)) {
          add_lone_approach(signal_index, map_.links(lane(index).predecessors), {index});
        } else {
          const Span<const int32_t> next = map_.links(lane(index).successors);
          add_lone_approach(signal_index, Span<const int32_t>(&index, 1), {next.begin(), next.end()});
        }
      }
    }
  }

  void add_lone_approach(std::size_t signal_index, Span<const int32_t> incoming,
                         const std::vector<int32_t>& connecting) {
    for (const int32_t from : incoming) {
      if (is_drivable(lane(from).type)) add_approach(from, connecting, &lone_approaches_[signal_index]);
    }
  }

  /// Returns lane `from` and the chain of its predecessors (or successors) on the same road, nearest first.
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

  /// Finds the approaches of a lane. A junction lane is followed back to the start of its road; the drivable
  /// predecessors there are the incoming lanes. A lane that leads to a junction is followed to the end of its road; the
  /// last lane there is the incoming lane.
  void find_approaches(int32_t start, Approaches* approaches) const {
    if (lane(start).in_junction) {
      const std::vector<int32_t> connecting = along_road(start, &Lane::predecessors);
      for (const int32_t incoming : map_.links(lane(connecting.back()).predecessors)) {
        if (is_drivable(lane(incoming).type)) add_approach(incoming, connecting, approaches);
      }
      return;
    }
    const int32_t incoming = along_road(start, &Lane::successors).back();
    std::vector<int32_t> connecting;
    for (const int32_t next : map_.links(lane(incoming).successors)) {
      if (lane(next).in_junction) connecting.push_back(next);
    }
    if (!connecting.empty()) add_approach(incoming, connecting, approaches);
  }

  void add_approach(int32_t incoming, const std::vector<int32_t>& connecting, Approaches* approaches) const {
    const FileRoad& road = build_.network.roads[lane(incoming).source_road];
    const bool forward = travels_forward(road, *build_.file_lanes[incoming].lane);
    Approach& approach = (*approaches)[{lane(incoming).source_road, forward}];
    approach.incoming.push_back(incoming);
    approach.connecting.insert(approach.connecting.end(), connecting.begin(), connecting.end());
  }

  /// Returns the junction of an approach, or -1 if it leads to none.
  int32_t junction_of(const Approach& approach) const {
    return approach.connecting.empty() ? -1 : lane(approach.connecting.front()).junction;
  }

  /// Adds a head without a controller to the stop lines of the approaches that it controls. Omits the head if other
  /// lights of its junction have controllers.
  void add_uncontrolled(std::size_t signal_index, const Approaches& approaches) {
    const FileSignal& signal = *placed_signals_[signal_index].signal;
    if (const char* const junction = ruled_junction(approaches)) {
      signal.where.record_repair(build_.faults, RepairKind::unlisted_light, "no controller of junction {} controls it",
                                 junction);
      return;
    }
    signal.where.record_repair(build_.faults, RepairKind::uncontrolled_light,
                               "no controller of a junction controls it");
    for (const auto& [way, approach] : approaches) {
      const int32_t junction_index = junction_of(approach);
      // Away from junctions, the first incoming lane distinguishes lines.
      const int32_t first = junction_index < 0 ? approach.incoming.front() : -1;
      const auto [line, is_new] = uncontrolled_.try_emplace({junction_index, way, first});
      if (is_new) line->second.signal_index = signal_index;
      Approach& whole = line->second.approach;
      whole.incoming.insert(whole.incoming.end(), approach.incoming.begin(), approach.incoming.end());
      whole.connecting.insert(whole.connecting.end(), approach.connecting.begin(), approach.connecting.end());
    }
  }

  /// Returns the name of a junction of the approaches that has lights with controllers, or null if there is none.
  const char* ruled_junction(const Approaches& approaches) const {
    for (const auto& [way, approach] : approaches) {
      const int32_t junction = junction_of(approach);
      if (junction < 0 || map_.junctions[junction].num_phases == 0) continue;
      return map_.junctions[junction].name.c_str();
    }
    return nullptr;
  }

  /// Adds a light for each line without a controller. Lines of one junction with roughly equal or opposite headings
  /// share a phase. A line away from junctions has its own phase.
  void add_uncontrolled_lights() {
    std::map<int32_t, std::vector<double>> headings;  // [junction] headings of the first line of each phase
    for (auto& [key, line] : uncontrolled_) {
      Phase phase{std::get<0>(key), 0};
      if (phase.junction >= 0) {
        std::vector<double>& phases = headings[phase.junction];
        const double heading = end_of(line.approach.incoming.front()).heading_rad;
        phase.phase = phase_of_heading(heading, &phases);
      }
      add_light(line.signal_index, phase, &line.approach);
    }
    for (const auto& [junction, phases] : headings) {
      map_.junctions[junction].num_phases = static_cast<int32_t>(phases.size());
    }
  }

  Eigen::Vector3d position_of(std::size_t signal_index) const {
    const FileSignal& signal = *placed_signals_[signal_index].signal;
    Eigen::Vector3d position = point_at(build_.network.roads[placed_signals_[signal_index].road], signal.s, signal.t);
    position.z() += signal.z_offset;
    return position;
  }

  void add_sign(std::size_t signal_index) {
    const FileSignal& signal = *placed_signals_[signal_index].signal;
    Sign sign{.name = signal.id, .type = signal.type, .subtype = signal.subtype, .country = signal.country};
    sign.position_m = build_.to_map(position_of(signal_index));
    // A sign has the heading of the lanes to which it applies, if there are any, because the orientations in files are
    // unreliable.
    double heading = pose_at(build_.network.roads[placed_signals_[signal_index].road], signal.s).heading;
    if (signal.orientation == Orientation::against) heading += std::numbers::pi;
    if (!signal_lanes_[signal_index].empty()) {
      const Span<const LanePoint> points = map_.points_of(lane(signal_lanes_[signal_index].front()));
      heading = std::min_element(points.begin(), points.end(), [&](const LanePoint& a, const LanePoint& b) {
                  return length(a.position_m - sign.position_m) < length(b.position_m - sign.position_m);
                })->heading_rad;
    }
    sign.heading_rad = static_cast<float>(std::remainder(heading, 2 * std::numbers::pi));
    sign.lanes.begin = static_cast<int32_t>(map_.sign_lanes.size());
    map_.sign_lanes.insert(map_.sign_lanes.end(), signal_lanes_[signal_index].begin(),
                           signal_lanes_[signal_index].end());
    sign.lanes.end = static_cast<int32_t>(map_.sign_lanes.size());
    map_.signs.push_back(sign);
    map_.provenance.signs.push_back(source_of(placed_signals_[signal_index].road, signal.where));
  }

  static void sort_unique(std::vector<int32_t>* lanes) {
    std::sort(lanes->begin(), lanes->end());
    lanes->erase(std::unique(lanes->begin(), lanes->end()), lanes->end());
  }

  void add_light(std::size_t signal_index, const Phase& phase, Approach* approach) {
    sort_unique(&approach->incoming);
    sort_unique(&approach->connecting);
    const FileSignal& signal = *placed_signals_[signal_index].signal;
    TrafficLight light;
    light.name = signal.id;
    light.junction = phase.junction;
    light.phase = phase.phase;

    // The stop line spans the ends of the incoming lanes, from the left border of the leftmost lane to the right border
    // of the rightmost lane.
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
        const Vec3 position{corner.x, corner.y, end.position_m.z};
        if (lateral_m > left_m) {
          left_m = lateral_m;
          light.stop_a_m = position;
        }
        if (lateral_m < right_m) {
          right_m = lateral_m;
          light.stop_b_m = position;
        }
      }
    }
    if (!(length((light.stop_b_m - light.stop_a_m).xy()) >= kMinStopLine_m)) {
      return signal.where.record_repair(build_.faults, RepairKind::laneless_light,
                                        "controls lanes that are less than {} m wide", kMinStopLine_m);
    }
    light.stop_heading_rad = reference.heading_rad;
    light.head_facing = Vec2{-direction.cos, -direction.sin};

    Eigen::Vector3d head = position_of(signal_index);
    const Vec2 middle = (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f;
    const float ahead_m = -dot(build_.to_map(head).xy() - middle, light.head_facing);
    head.z() += (ahead_m > kFarHead_m ? kFarHeadHeight_m : kNearHeadHeight_m);
    light.head_m = build_.to_map(head);

    light.lanes.begin = static_cast<int32_t>(map_.light_lanes.size());
    map_.light_lanes.insert(map_.light_lanes.end(), approach->incoming.begin(), approach->incoming.end());
    map_.light_lanes.insert(map_.light_lanes.end(), approach->connecting.begin(), approach->connecting.end());
    light.lanes.end = static_cast<int32_t>(map_.light_lanes.size());
    map_.lights.push_back(light);
    map_.provenance.lights.push_back(source_of(placed_signals_[signal_index].road, signal.where));
  }

  Build& build_;
  RoadMap& map_;
  std::vector<PlacedSignal> placed_signals_;
  std::unordered_map<std::string, std::size_t> index_by_id_;
  std::vector<std::vector<int32_t>> signal_lanes_;  // [signals] lanes to which the signal applies
  std::unordered_map<std::string, Phase> phases_;
  std::map<std::size_t, Approaches> lone_approaches_;  // [signals] away from junctions
  // The key is the junction, the approach and, away from junctions, the first incoming lane (else -1).
  std::map<std::tuple<int32_t, std::pair<int32_t, bool>, int32_t>, UncontrolledLine> uncontrolled_;
};

}  // namespace

void build_signals(Build* build) { SignalBuilder(build).run(); }

}  // namespace pictura::opendrive
