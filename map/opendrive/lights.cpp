#include "pictura/map/opendrive/lights.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_map>
#include <unordered_set>

#include "pictura/map/opendrive/build.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura::opendrive {

namespace {

constexpr double kSameLine_m = 20;

std::unordered_set<std::string> controlled_signals(const Network& network) {
  std::unordered_map<std::string_view, const FileController*> controllers;
  for (const FileController& controller : network.controllers) controllers.emplace(controller.id, &controller);
  std::unordered_set<std::string> signals;
  for (const FileJunction& junction : network.junctions) {
    for (const std::string& id : junction.controllers) {
      const auto found = controllers.find(id);
      if (found != controllers.end()) signals.insert(found->second->signals.begin(), found->second->signals.end());
    }
  }
  return signals;
}

/// Whether a signal applies to a driving lane of its road, but to no driving lane that leads to a junction.
template <typename Signal>
bool is_away_from_junctions(const FileRoad& road, const Signal& signal) {
  if (!road.junction.empty()) return false;
  bool has_lane = false;
  const FileSection& section = section_at(road, signal.s);
  for (const std::vector<FileLane>* side : {&section.left, &section.right}) {
    for (const FileLane& lane : *side) {
      if (lane.type != LaneType::driving || !applies_to(lane, road, signal.orientation, signal.validity)) continue;
      const RoadLink& ahead = travels_forward(road, lane) ? road.successor : road.predecessor;
      if (ahead.kind == RoadLink::Kind::junction) return false;
      has_lane = true;
    }
  }
  return has_lane;
}

/// Station of a head, and the variable that receives the station of its stop line.
struct Head {
  double s = 0;
  Orientation orientation = Orientation::either;
  std::optional<double>* stop_s = nullptr;
};

/// Sets the stop line of each head. Heads within 20 m share the stop line of the head that traffic reaches first.
void find_lines(bool forward, std::vector<Head>* heads) {
  std::sort(heads->begin(), heads->end(),
            [forward](const Head& a, const Head& b) { return forward ? a.s < b.s : a.s > b.s; });
  double line = 0;
  bool is_first = true;
  for (const Head& head : *heads) {
    if (is_first || std::abs(head.s - line) > kSameLine_m) line = head.s;
    is_first = false;
    *head.stop_s = line;
  }
}

}  // namespace

bool applies_to(const FileLane& lane, const FileRoad& road, Orientation orientation,
                const std::vector<LaneRange>& validity) {
  if (validity.empty()) {
    return orientation == Orientation::either || (orientation == Orientation::along) == travels_forward(road, lane);
  }
  return std::any_of(validity.begin(), validity.end(), [&](const LaneRange& range) {
    return lane.id >= std::min(range.from, range.to) && lane.id <= std::max(range.from, range.to);
  });
}

void split_at_lights(Network* network) {
  const std::unordered_set<std::string> controlled = controlled_signals(*network);
  std::unordered_set<std::string> lights, referenced;  // ids of lights without a controller
  for (const FileRoad& road : network->roads) {
    for (const FileSignal& signal : road.signals) {
      if (signal.type == kLightType && !controlled.contains(signal.id)) lights.insert(signal.id);
    }
    for (const SignalReference& reference : road.signal_references) referenced.insert(reference.signal);
  }
  if (lights.empty()) return;
  for (FileRoad& road : network->roads) {
    std::vector<Head> heads;
    const auto add = [&](auto* signal) {
      if (is_away_from_junctions(road, *signal)) heads.push_back({signal->s, signal->orientation, &signal->stop_s});
    };
    for (FileSignal& signal : road.signals) {
      if (signal.type == kLightType && lights.contains(signal.id) && !referenced.contains(signal.id)) add(&signal);
    }
    for (SignalReference& reference : road.signal_references) {
      if (lights.contains(reference.signal)) add(&reference);
    }
    for (const Orientation orientation : {Orientation::along, Orientation::against, Orientation::either}) {
      std::vector<Head> together;
      for (const Head& head : heads) {
        if (head.orientation == orientation) together.push_back(head);
      }
      find_lines(orientation != Orientation::against, &together);
      for (const Head& head : together) split_section(**head.stop_s, &road);
    }
  }
}

}  // namespace pictura::opendrive
