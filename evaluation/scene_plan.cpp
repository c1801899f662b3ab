#include "pictura/evaluation/scene_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pictura/common/error.h"
#include "pictura/common/math.h"
#include "pictura/common/rng.h"
#include "pictura/common/support/hash.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/simulator/rules/limits.h"
#include "pictura/simulator/rules/spawn.h"

namespace pictura {

namespace {

/// Returns whether an agent cannot start driving from its box: the box touches an edge, is off the road, or overlaps
/// the box of an agent that is not removed.
bool overlaps(const MapView& map, Span<const AgentBox> boxes, const std::vector<SceneRole>& roles, size_t track) {
  const AgentBox& box = boxes[track];
  if (!fits_map(map, box)) return true;
  for (size_t other = 0; other < boxes.size(); ++other) {
    if (other == track || roles[other] == SceneRole::removed || !boxes[other].drawn) continue;
    if (same_level(box, boxes[other]) && overlap(footprint(box), footprint(boxes[other]))) return true;
  }
  return false;
}

/// Returns the episode step at which a driver would take over each track, regardless of overlaps and thinning,
/// [tracks]; -1: never.
std::vector<int32_t> takeovers(const CompiledMap& map, const SceneProtocol& protocol) {
  const Scenario& scene = *map.scenario;
  const MapRecord& record = map.rules.record;
  const std::vector<uint8_t> named = tracks_selected_by(scene, protocol.control);
  std::vector<int32_t> steps(named.size(), -1);
  for (size_t track = 0; track < named.size(); ++track) {
    if (!named[track]) continue;
    if (protocol.replay_experts && scene.tracks[track].control == RecordedControl::expert) continue;
    const int32_t step = record.first_step(track);
    if (step < 0 || (step > 0 && protocol.late != Late::drive)) continue;
    const Vec3 from = record.state(track, step).position_m, goal = record.agents[track].goal_m;
    if (protocol.min_distance_to_goal_m > 0 && passes(from, from, goal, protocol.min_distance_to_goal_m)) continue;
    steps[track] = step;
  }
  return steps;
}

/// Replaces the first heading of tracks, from start_step on, that turn by more than this to the next step. Counts them
/// in Scenario::repaired_headings.
void repair_first_headings(int32_t start_step, float max_turn_deg, Scenario* scenario_inout) {
  for (size_t track = 0; track < scenario_inout->tracks.size(); ++track) {
    const Span<const uint8_t> valid = scenario_inout->valid_of(static_cast<int32_t>(track));
    const auto first = std::find(valid.begin() + start_step, valid.end(), 1);
    if (valid.end() - first < 2 || !first[1]) continue;
    TrackState* const state =
        &scenario_inout->states[track * valid.size() + static_cast<size_t>(first - valid.begin())];
    const float turn_rad = wrap_angle(state[1].heading_rad - state[0].heading_rad);
    if (std::abs(turn_rad) * (180 / kPi) <= max_turn_deg) continue;
    state[0].heading_rad = state[1].heading_rad;
    ++scenario_inout->repaired_headings;
  }
}

}  // namespace

void check_time_step(const Scenario& scenario) {
  constexpr float kStep_s = kMaxStep_s, kTolerance = 0.01f;
  PICTURA_CHECK(std::abs(scenario.dt_s - kStep_s) <= kTolerance * kStep_s,
                "scene {}: expected time steps of {} s, got {} s", scenario.id, kStep_s, scenario.dt_s);
}

std::shared_ptr<const Scenario> protocol_scene(Scenario scenario, const SceneProtocol& protocol) {
  check_time_step(scenario);
  for (RecordedTrack& track : scenario.tracks) {
    track.length_m *= protocol.box_scale;
    track.width_m *= protocol.box_scale;
  }
  if (protocol.max_first_turn_deg > 0 && protocol.start_step < scenario.num_steps) {
    repair_first_headings(protocol.start_step, protocol.max_first_turn_deg, &scenario);
  }
  return std::make_shared<const Scenario>(std::move(scenario));
}

std::vector<uint8_t> select_thinned_tracks(const Scenario& scenario, double density, uint64_t seed) {
  const auto scene = static_cast<uint32_t>(hash_of(scenario.id));
  std::vector<std::pair<uint32_t, size_t>> draws;
  for (size_t track = 0; track < scenario.tracks.size(); ++track) {
    if (static_cast<int32_t>(track) == scenario.sdc_track) continue;
    RandomStream random(
        {.seed = seed, .world = scene, .agent = static_cast<uint32_t>(track), .purpose = Purpose::spawn});
    draws.emplace_back(random.bits(), track);
  }
  std::sort(draws.begin(), draws.end());
  const auto count = static_cast<size_t>(std::lround((1 - density) * static_cast<double>(draws.size())));
  std::vector<uint8_t> out(scenario.tracks.size());
  for (size_t i = 0; i < count; ++i) out[draws[i].second] = 1;
  return out;
}

bool has_drivers(const CompiledMap& map, const SceneProtocol& protocol) {
  const std::vector<int32_t> steps = takeovers(map, protocol);
  return std::any_of(steps.begin(), steps.end(), [](int32_t step) { return step >= 0; });
}

ScenePlan plan_scene(const CompiledMap& map, Span<const AgentBox> boxes, const SceneProtocol& protocol, double density,
                     uint64_t seed) {
  const Scenario& scene = *map.scenario;
  const size_t num_tracks = scene.tracks.size();
  PICTURA_CHECK(boxes.size() == num_tracks, "scene {}: expected {} boxes, got {}", scene.id, num_tracks, boxes.size());
  ScenePlan plan{std::vector<SceneRole>(num_tracks, SceneRole::replayed), takeovers(map, protocol)};
  const std::vector<uint8_t> thinned = select_thinned_tracks(scene, density, seed);
  for (size_t track = 0; track < num_tracks; ++track) {
    const bool is_named = plan.takeover_steps[track] >= 0;
    const bool is_other = static_cast<AgentClass>(map.rules.record.agents[track].agent_class) != AgentClass::vehicle;
    const bool is_left_out = (is_other && !is_named && protocol.others == Others::absent) ||
                             (protocol.late == Late::absent && !boxes[track].drawn);
    if (thinned[track] || is_left_out) plan.roles[track] = SceneRole::removed;
  }
  // The self-driving car comes first, so that a maximum number of driven road users never excludes it.
  std::vector<size_t> order(num_tracks);
  std::iota(order.begin(), order.end(), size_t{0});
  if (scene.sdc_track >= 0) {
    const auto self = order.begin() + scene.sdc_track;
    std::rotate(order.begin(), self, self + 1);
  }
  const MapView view = map.rules.view();
  int num_driven = 0;
  for (const size_t track : order) {
    if (plan.roles[track] == SceneRole::removed || plan.takeover_steps[track] < 0) continue;
    if (protocol.max_driven > 0 && num_driven >= protocol.max_driven) break;
    const bool starts = plan.takeover_steps[track] == 0;
    if (protocol.overlapping == Overlapping::replay && starts && overlaps(view, boxes, plan.roles, track)) continue;
    plan.roles[track] = SceneRole::driven;
    ++num_driven;
  }
  return plan;
}

std::vector<Vec3> path_waypoints(const CompiledMap& map, int32_t track, int32_t takeover_step) {
  const auto index = static_cast<size_t>(track);
  std::vector<Vec3> path;
  std::vector<float> way_m;
  for (int32_t step = takeover_step; step < map.rules.record.num_steps; ++step) {
    const RecordedState& state = map.rules.record.state(index, step);
    if (!state.is_present) continue;
    way_m.push_back(path.empty() ? 0.0f : way_m.back() + length((state.position_m - path.back()).xy()));
    path.push_back(state.position_m);
  }
  std::vector<Vec3> waypoints;
  for (int i = 1; i < kNumWaypoints && !path.empty(); ++i) {
    const float at_m = way_m.back() * static_cast<float>(i) / static_cast<float>(kNumWaypoints);
    waypoints.push_back(path[std::lower_bound(way_m.begin(), way_m.end(), at_m) - way_m.begin()]);
  }
  waypoints.push_back(map.rules.record.agents[index].goal_m);
  return waypoints;
}

}  // namespace pictura
