// Inverse of make_scenario(): converts a scenario to a scene that a program could have written.
#include <algorithm>
#include <charconv>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

#include "pictura/map/scenario/logged_scene.h"

namespace pictura {

namespace {

constexpr std::string_view kStopSign = "206";  // code in OpenDRIVE's catalogue

class SceneBuilder {
 public:
  explicit SceneBuilder(const Scenario& scenario) : from_(scenario), map_(scenario.map) {
    scene_.source = scenario.id;
    scene_.id = scenario.id;
    scene_.name = map_.name;
    scene_.format = scenario.format;
    scene_.dt_s = double{scenario.dt_s};
    scene_.num_steps = scenario.num_steps;
    scene_.current_step = scenario.current_step;
    scene_.sdc_track = scenario.sdc_track;
    scene_.is_authored = true;
    scene_.tolerance_m = 0;
    scene_.origin_m = origin_;
  }

  LoggedScene result() {
    find_lane_ids();
    find_track_ids();
    state_tracks();
    state_lanes();
    state_paint();
    state_edges();
    state_lights();
    return std::move(scene_);
  }

 private:
  Eigen::Vector3d in_file(Vec3 p) const { return origin_ + Eigen::Vector3d(double{p.x}, double{p.y}, double{p.z}); }

  LoggedPoints in_file(const std::vector<Vec3>& points, IndexRange range) const {
    LoggedPoints stated;
    for (int32_t i = range.begin; i < range.end; ++i) stated.push_back(in_file(points[i]));
    return stated;
  }

  void find_lane_ids() {
    std::set<int64_t> known;
    for (const Lane& lane : map_.lanes) {
      const std::string& name = map_.road_names[lane.source_road];
      int64_t id = -1;
      const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), id);
      if (error != std::errc() || end != name.data() + name.size() || id < 0 || !known.insert(id).second) break;
      lane_ids_.push_back(id);
    }
    if (lane_ids_.size() == map_.lanes.size()) return;
    lane_ids_.clear();
    for (std::size_t i = 0; i < map_.lanes.size(); ++i) lane_ids_.push_back(static_cast<int64_t>(i));
  }

  /// Replaces ids that repeat, because objects of interest are stated by the ids of their tracks.
  void find_track_ids() {
    std::set<int64_t> known;
    for (const RecordedTrack& track : from_.tracks) {
      known.insert(track.id);
      track_ids_.push_back(track.id);
    }
    if (known.size() < track_ids_.size()) std::iota(track_ids_.begin(), track_ids_.end(), 0);
  }

  std::vector<int64_t> ids_of(const std::vector<int32_t>& lanes, IndexRange range) const {
    std::vector<int64_t> ids;
    for (int32_t i = range.begin; i < range.end; ++i) ids.push_back(lane_ids_[lanes[i]]);
    return ids;
  }

  void state_tracks() {
    for (std::size_t i = 0; i < from_.tracks.size(); ++i) {
      const RecordedTrack& track = from_.tracks[i];
      LoggedTrack& logged = scene_.tracks.emplace_back();
      logged.id = track_ids_[i];
      logged.type = track.type;
      logged.control = track.control;
      const Span<const TrackState> states = from_.states_of(static_cast<int32_t>(i));
      const Span<const uint8_t> valid = from_.valid_of(static_cast<int32_t>(i));
      for (std::size_t step = 0; step < states.size(); ++step) {
        LoggedState& state = logged.states.emplace_back();
        state.length_m = double{track.length_m};
        state.width_m = double{track.width_m};
        state.height_m = double{track.height_m};
        state.valid = valid[step] != 0;
        if (!state.valid) continue;
        state.center_m = in_file(states[step].position_m);
        // The float that is nearest to pi exceeds pi, and would be wrapped to -pi.
        state.heading_rad = std::clamp(double{states[step].heading_rad}, -std::numbers::pi, std::numbers::pi);
        state.velocity_x_mps = double{states[step].velocity_mps.x};
        state.velocity_y_mps = double{states[step].velocity_mps.y};
      }
    }
    for (const int32_t track : from_.objects_of_interest) scene_.objects_of_interest.push_back(track_ids_[track]);
    for (const PredictedTrack& predicted : from_.tracks_to_predict) {
      scene_.predictions.emplace_back(predicted.track, predicted.difficulty);
    }
  }

  void state_lanes() {
    for (std::size_t i = 0; i < map_.lanes.size(); ++i) {
      const Lane& lane = map_.lanes[i];
      LoggedLane& logged = scene_.lanes.emplace_back();
      logged.id = lane_ids_[i];
      logged.map_type = lane.type;
      logged.speed_limit_mps = double{lane.speed_limit_mps};
      logged.interpolating = lane.in_junction;
      for (const LanePoint& point : map_.points_of(lane)) {
        logged.points.push_back(in_file(point.position_m));
        logged.widths_m.push_back(double{point.width_m});
      }
      logged.entries = ids_of(map_.lane_links, lane.predecessors);
      logged.exits = ids_of(map_.lane_links, lane.successors);
      if (lane.left_neighbor >= 0) logged.left_neighbors = {{.lane = lane_ids_[lane.left_neighbor]}};
      if (lane.right_neighbor >= 0) logged.right_neighbors = {{.lane = lane_ids_[lane.right_neighbor]}};
    }
  }

  void state_paint() {
    for (const Marking& marking : map_.markings) {
      if (marking.color != MarkColor::white && marking.color != MarkColor::yellow) continue;
      const bool is_white = marking.color == MarkColor::white;
      const LoggedLineType solid = is_white ? LoggedLineType::solid_single_white : LoggedLineType::solid_single_yellow;
      const LoggedLineType dash = is_white ? LoggedLineType::dash_white : LoggedLineType::dash_yellow;
      scene_.lines.push_back({.id = static_cast<int64_t>(scene_.lines.size()),
                              .type = marking.broken ? dash : solid,
                              .points = in_file(map_.marking_points, marking.points)});
    }
    for (const Crosswalk& crosswalk : map_.crosswalks) {
      scene_.crosswalks.push_back({.id = static_cast<int64_t>(scene_.crosswalks.size()),
                                   .points = in_file(map_.outline_points, crosswalk.outline)});
    }
    for (const Sign& sign : map_.signs) {
      if (sign.type != kStopSign) continue;
      scene_.stop_signs.push_back({.id = static_cast<int64_t>(scene_.stop_signs.size()),
                                   .lanes = ids_of(map_.sign_lanes, sign.lanes),
                                   .position_m = in_file(sign.position_m)});
    }
  }

  /// Joins consecutive edges, and reverses them, because the edges of a RoadMap have the road on their right.
  void state_edges() {
    for (std::size_t i = 0; i < map_.road_edges.size(); ++i) {
      const RoadEdge& edge = map_.road_edges[i];
      const bool joins = i > 0 && length(map_.road_edges[i - 1].b_m - edge.a_m) == 0;
      if (!joins)
        scene_.edges.push_back({.id = static_cast<int64_t>(scene_.edges.size()), .points = {in_file(edge.a_m)}});
      scene_.edges.back().points.push_back(in_file(edge.b_m));
    }
    for (LoggedEdge& edge : scene_.edges) std::reverse(edge.points.begin(), edge.points.end());
  }

  void state_lights() {
    for (std::size_t i = 0; i < from_.lights.size(); ++i) {
      const RecordedLight& light = from_.lights[i];
      const Span<const RecordedLightState> states = from_.states_of_light(static_cast<int32_t>(i));
      scene_.lights.push_back({.lanes = ids_of(from_.light_lanes, light.lanes),
                               .has_stop_line = true,
                               .stop_a_m = in_file(light.stop_a_m),
                               .stop_b_m = in_file(light.stop_b_m),
                               .states = {states.begin(), states.end()}});
    }
  }

  const Scenario& from_;
  const RoadMap& map_;
  const Eigen::Vector3d origin_{map_.origin_m[0], map_.origin_m[1], map_.origin_m[2]};
  std::vector<int64_t> lane_ids_, track_ids_;
  LoggedScene scene_;
};

}  // namespace

LoggedScene scene_of_scenario(const Scenario& scenario) { return SceneBuilder(scenario).result(); }

}  // namespace pictura
