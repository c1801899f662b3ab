#include "pictura/evaluation/probes/corner_states.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "pictura/evaluation/probes/probe_run.h"
#include "pictura/map/blind_approaches.h"

namespace pictura {

namespace {

Vec3 end_of(const RoadMap& map, int32_t lane) {
  const Span<const LanePoint> points = map.points_of(map.lanes[lane]);
  return points[points.size() - 1].position_m;
}

// Returns the lane `approach` into a junction and the lanes that lead to `approach`, the nearest first.
std::vector<int32_t> lanes_to(const RoadMap& map, int32_t approach) {
  std::vector<int32_t> lanes{approach};
  float length_m = map.lanes[approach].length_m;
  while (length_m < kCornerLead_m) {
    const Span<const int32_t> before = map.links(map.lanes[lanes.back()].predecessors);
    if (before.empty() || map.lanes[before[0]].in_junction) break;
    lanes.push_back(before[0]);
    length_m += map.lanes[before[0]].length_m;
  }
  return lanes;
}

auto order_of(const CornerState& one) { return std::tuple(one.scene, one.step, one.ego, one.user); }

}  // namespace

BlindCorners find_blind_corners(const RoadMap& map, Span<const WallFace> walls) {
  const std::set<int32_t> lit(map.light_lanes.begin(), map.light_lanes.end());
  BlindCorners corners;
  for (const BlindCrossing& crossing : find_blind_crossings(map, walls)) {
    if (lit.contains(crossing.approach) || lit.contains(crossing.other_approach)) continue;
    const Span<const int32_t> next = map.links(map.lanes[crossing.approach].successors);
    for (const int32_t lane : lanes_to(map, crossing.approach)) {
      BlindCorner& corner = corners[lane];
      corner.junction = map.lanes[next[0]].junction;
      corner.entry_m = end_of(map, crossing.approach);
      for (const int32_t other : lanes_to(map, crossing.other_approach))
        corner.lanes[other] = end_of(map, crossing.other_approach);
    }
  }
  return corners;
}

std::vector<CornerState> find_corner_states(const ProbeFrame& frame, size_t world, const RoadMap& map,
                                            const BlindCorners& corners, const LineOfSight& line_of_sight,
                                            const PinholeCamera& front, const CornerSearch& search) {
  const WorldSpec& spec = frame.worlds[world];
  const int32_t first = frame.slot_begin[world];
  const auto box_of = [&](int32_t agent) -> const AgentBox& { return frame.boxes[frame.box_begin[world] + agent]; };
  std::vector<CornerState> states;
  for (int32_t ego = 0; ego < spec.num_agents; ++ego) {
    const auto slot = static_cast<size_t>(first + ego);
    if (!frame.is_ego(slot) || frame.speed_mps[slot] < search.min_speed_mps) continue;
    const auto found = corners.find(frame.lane[slot]);
    if (found == corners.end()) continue;
    const BlindCorner& corner = found->second;
    const View& view = frame.views[slot];
    const float distance_m = length((corner.entry_m - view.origin_m).xy());
    if (distance_m < search.min_distance_m || distance_m > search.max_distance_m) continue;

    CornerState state{.scene = frame.scene_of(world),
                      .map = spec.map,
                      .driver = frame.driver,
                      .step = frame.step,
                      .ego = ego,
                      .approach = found->first,
                      .distance_m = distance_m,
                      .speed_mps = frame.speed_mps[slot],
                      .view = view};
    const Vec3 eye_m = place_camera(front, view).position_m;
    bool is_empty = true;
    float nearest_m = search.user_range_m;
    for (int32_t other = 0; other < spec.num_agents; ++other) {
      const auto its_slot = static_cast<size_t>(first + other);
      const int32_t lane = frame.lane[its_slot];
      const bool drives = frame.agent_class[its_slot] != AgentClass::pedestrian;
      if (other == ego || lane < 0 || !drives || !frame.is_present(its_slot)) continue;
      is_empty &= map.lanes[lane].junction != corner.junction;
      const auto crossing = corner.lanes.find(lane);
      if (crossing == corner.lanes.end()) continue;
      const float its_distance_m = length((crossing->second - box_of(other).center_m).xy());
      if (its_distance_m > search.user_range_m) continue;
      is_empty = false;
      const bool comes = frame.is_ego(its_slot) && frame.speed_mps[its_slot] >= search.min_speed_mps;
      if (!comes || its_distance_m > nearest_m) continue;
      if (!line_of_sight.is_hidden(eye_m, box_of(other))) continue;
      nearest_m = its_distance_m;
      state.user = other;
    }
    if (is_empty || state.user >= 0) states.push_back(state);
  }
  return states;
}

std::vector<CornerPair> match_corners(const std::vector<CornerState>& hidden, const std::vector<CornerState>& empty,
                                      int64_t count) {
  // First hidden state of each pair of ego and user, by scene.
  std::map<int32_t, std::vector<CornerState>> of_scene;
  std::vector<CornerState> ordered = hidden, unused = empty;
  const auto before = [](const CornerState& a, const CornerState& b) { return order_of(a) < order_of(b); };
  std::sort(ordered.begin(), ordered.end(), before);
  std::sort(unused.begin(), unused.end(), before);
  std::set<std::tuple<int32_t, int32_t, int32_t>> approached;
  for (const CornerState& one : ordered) {
    if (approached.insert({one.scene, one.ego, one.user}).second) of_scene[one.scene].push_back(one);
  }

  std::vector<CornerPair> pairs;
  bool is_left = true;
  for (size_t turn = 0; is_left; ++turn) {
    is_left = false;
    for (const auto& [scene, states] : of_scene) {
      if (turn >= states.size() || static_cast<int64_t>(pairs.size()) == count) continue;
      is_left = true;
      const CornerState& one = states[turn];
      const CornerState* likest = nullptr;
      float minimum = 3;  // sum of both differences, in units of the tolerances
      for (const CornerState& other : unused) {
        if (other.scene == one.scene && other.ego == one.ego) continue;
        const float apart = std::abs(other.distance_m - one.distance_m) / kSameDistance_m,
                    faster = std::abs(other.speed_mps - one.speed_mps) / kSameSpeed_mps;
        if (apart > 1 || faster > 1 || apart + faster >= minimum) continue;
        minimum = apart + faster;
        likest = &other;
      }
      if (!likest) continue;
      const CornerState match = *likest;
      pairs.push_back({one, match});
      std::erase_if(unused, [&match](const CornerState& other) {
        return other.scene == match.scene && other.ego == match.ego && other.approach == match.approach;
      });
    }
  }
  std::sort(pairs.begin(), pairs.end(),
            [&before](const CornerPair& a, const CornerPair& b) { return before(a.hidden, b.hidden); });
  return pairs;
}

}  // namespace pictura
