// Runs the stages of the conversion. Contains the functions that stages share, and the stages for tracks and lights.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pictura/common/error.h"
#include "pictura/common/scene.h"
#include "pictura/map/endless_lanes.h"
#include "pictura/map/scenario/conversion.h"

namespace pictura {

namespace conversion {

namespace {

// Maximum differences between stop points, and between headings at the starts of lanes, of lanes that share one light.
constexpr double kSameStopPoint_m = 0.5, kSameHeading_rad = 0.5;
constexpr float kMinStopLine_m = 1;        // across lanes that begin with almost no width
constexpr double kAuthoredPiece_m = 9.99;  // used instead of kMaxPiece_m for scenes that a program wrote

float wrapped(double heading_rad) { return static_cast<float>(std::remainder(heading_rad, 2 * std::numbers::pi)); }

void check_radius(const Conversion& conversion, const std::string& what, const Eigen::Vector3d& p) {
  PICTURA_CHECK(
      p.cwiseAbs().maxCoeff() <= kMaxScenarioRadius_m,
      "{}: {}: expected coordinates within {} m of the map's centre ({:.0f}, {:.0f}, {:.0f}), got ({}, {}, {})",
      conversion.scene.source, what, kMaxScenarioRadius_m, conversion.origin.x(), conversion.origin.y(),
      conversion.origin.z(), p.x() + conversion.origin.x(), p.y() + conversion.origin.y(),
      p.z() + conversion.origin.z());
}

}  // namespace

std::vector<CurvePoint> cut_into_pieces(Conversion* conversion, const std::vector<CurvePoint>& points,
                                        const std::string& what) {
  std::vector<CurvePoint> dense;
  for (const CurvePoint& next : points) {
    if (!dense.empty()) {
      const CurvePoint last = dense.back();
      const double way_m = plan_distance_m(last.position_m, next.position_m);
      if (way_m < kSamePoint_m) {
        conversion->scene.note("points that repeat the one before left out", what);
        continue;
      }
      // Pieces are slightly shorter than allowed, because rounding must not make a piece so long that it would be cut
      // again.
      const double piece_m =
          conversion->scene.is_authored && way_m > kMaxPiece_m ? kAuthoredPiece_m : double{kMaxPiece_m};
      const int pieces = static_cast<int>(std::ceil(way_m / piece_m - kPieceRounding));
      conversion->count_work(static_cast<std::size_t>(pieces));
      for (int k = 1; k < pieces; ++k) {
        const double t = static_cast<double>(k) / pieces;
        dense.push_back({0, conversion->rounded(last.position_m + t * (next.position_m - last.position_m)),
                         last.width + t * (next.width - last.width)});
      }
    }
    dense.push_back(next);
  }
  return dense;
}

std::vector<CurvePoint> resampled(Conversion* conversion, const LoggedPoints& points, const std::vector<double>& widths,
                                  const std::string& what) {
  const LoggedScene& scene = conversion->scene;
  std::vector<CurvePoint> line;
  conversion->count_work(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    line.push_back({0, conversion->rounded(conversion->from_origin(points[i])), widths.empty() ? 0 : widths[i]});
    check_radius(*conversion, what, line.back().position_m);
  }
  line = cut_into_pieces(conversion, line, what);
  if (line.size() < 2) return {};
  if (scene.tolerance_m > 0) {
    std::vector<CurvePoint> thinned;
    // Thinning tests each point against the other points of its piece. A straight piece has about twenty points.
    conversion->count_work(line.size() * 20);
    for (const std::size_t index : thin_polyline(line, scene.tolerance_m, kMaxPiece_m)) thinned.push_back(line[index]);
    line = std::move(thinned);
  }
  // Removes duplicates. After points have been omitted, points at both ends of the omitted part may be duplicates.
  line = cut_into_pieces(conversion, line, what);
  if (line.size() < 2) return {};
  return line;
}

void choose_origin(Conversion* conversion) {
  Eigen::Vector3d low, high;
  bool any = false;
  const auto add = [&](const LoggedPoints& points) {
    for (const Eigen::Vector3d& p : points) {
      low = any ? low.cwiseMin(p).eval() : p;
      high = any ? high.cwiseMax(p).eval() : p;
      any = true;
    }
  };
  for (const LoggedLane& lane : conversion->scene.lanes) add(lane.points);
  for (const LoggedEdge& edge : conversion->scene.edges) add(edge.points);
  PICTURA_CHECK(any && !conversion->scene.lanes.empty(), "{}: {}: expected at least one lane, got none",
                conversion->scene.source, conversion->scene.names.features);
  for (int axis = 0; axis < 3; ++axis) conversion->origin[axis] = std::round(0.5 * (low[axis] + high[axis])) + 0.0;
  if (conversion->scene.origin_m) conversion->origin = *conversion->scene.origin_m;
  conversion->out->map.origin_m = {conversion->origin.x(), conversion->origin.y(), conversion->origin.z()};
}

void make_tracks(Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  Scenario& out = *conversion->out;
  PICTURA_CHECK(scene.num_steps >= 1 && scene.num_steps <= kMaxScenarioSteps, "{}: expected 1 to {} steps, got {}",
                scene.source, kMaxScenarioSteps, scene.num_steps);
  PICTURA_CHECK(scene.tracks.size() <= kMaxScenarioTracks, "{}: {}: expected at most {}, got {}", scene.source,
                scene.names.tracks, kMaxScenarioTracks, scene.tracks.size());
  const std::size_t steps = static_cast<std::size_t>(scene.num_steps);
  conversion->count_work(scene.tracks.size() * steps);
  std::vector<int32_t> kept(scene.tracks.size(), -1);
  std::unordered_map<int64_t, int32_t> of_id;
  for (std::size_t i = 0; i < scene.tracks.size(); ++i) {
    const LoggedTrack& logged = scene.tracks[i];
    const std::string place = fmt::format("{}[{}]", scene.names.tracks, i);
    PICTURA_CHECK(logged.states.size() == steps, "{}: {}: expected {} states, got {}", scene.source, place, steps,
                  logged.states.size());
    RecordedTrack track{.id = logged.id, .type = logged.type, .control = logged.control, .first_valid = -1};
    for (std::size_t step = 0; step < steps; ++step) {
      if (!logged.states[step].valid) continue;
      if (track.first_valid < 0) track.first_valid = static_cast<int32_t>(step);
      track.last_valid = static_cast<int32_t>(step);
      ++track.num_valid;
    }
    if (track.num_valid == 0) {
      scene.note("tracks without a valid state left out", place);
      continue;
    }
    // A present step outside of the scene is refused later.
    const bool is_present = scene.current_step >= 0 && scene.current_step < scene.num_steps &&
                            logged.states[static_cast<std::size_t>(scene.current_step)].valid;
    const auto sized = static_cast<std::size_t>(is_present ? scene.current_step : track.last_valid);
    const LoggedState& its_size = logged.states[sized];
    track.length_m = static_cast<float>(its_size.length_m);
    track.width_m = static_cast<float>(its_size.width_m);
    track.height_m = static_cast<float>(its_size.height_m);
    for (const auto& [field, size_m] : {std::pair{"length", track.length_m}, std::pair{"width", track.width_m},
                                        std::pair{"height", track.height_m}}) {
      PICTURA_CHECK(size_m > 0 && size_m <= kMaxTrackSize_m,
                    "{}: {}: {}: expected a number in (0, {}] at step {}, got {}", scene.source, place, field,
                    kMaxTrackSize_m, sized, size_m);
    }
    for (std::size_t step = 0; step < steps; ++step) {
      const LoggedState& state = logged.states[step];
      out.valid.push_back(state.valid ? 1 : 0);
      if (!state.valid) {
        out.states.emplace_back();
        continue;
      }
      Eigen::Vector3d p = conversion->rounded(conversion->from_origin(state.center_m));
      check_radius(*conversion, fmt::format("{}: step {}", place, step), p);
      for (const auto& [field, mps] :
           {std::pair{"velocity_x", state.velocity_x_mps}, std::pair{"velocity_y", state.velocity_y_mps}}) {
        PICTURA_CHECK(std::abs(mps) <= double{kMaxScenarioRadius_m},
                      "{}: {}: step {}: {}: expected a number of at most {} in magnitude, got {}", scene.source, place,
                      step, field, kMaxScenarioRadius_m, mps);
      }
      // Recorded sizes vary along a track, so the bottom face is half of the current step's height below the centre.
      if (!scene.is_authored) p.z() -= 0.5 * (state.height_m > 0 ? state.height_m : its_size.height_m);
      out.states.push_back({to_vec3(p),
                            wrapped(state.heading_rad),
                            {static_cast<float>(state.velocity_x_mps), static_cast<float>(state.velocity_y_mps)}});
    }
    kept[i] = static_cast<int32_t>(out.tracks.size());
    if (!of_id.emplace(track.id, kept[i]).second) scene.note("track ids used twice", place);
    out.tracks.push_back(track);
  }
  PICTURA_CHECK(!out.tracks.empty(), "{}: {}: expected at least one track with a valid state, got none", scene.source,
                scene.names.tracks);
  const auto kept_track = [&](const char* what, int32_t index) {
    PICTURA_CHECK(index >= 0 && index < static_cast<int32_t>(kept.size()),
                  "{}: {}: expected an index in [0, {}), got {}", scene.source, what, kept.size(), index);
    const int32_t track = kept[index];
    if (track < 0) scene.note("references to tracks that were left out", what);
    return track;
  };
  if (scene.sdc_track >= 0) out.sdc_track = kept_track("sdc_track_index", scene.sdc_track);
  for (const int64_t id : scene.objects_of_interest) {
    if (const auto found = of_id.find(id); found != of_id.end()) {
      out.objects_of_interest.push_back(found->second);
    } else {
      scene.note("objects of interest that are no track", fmt::format("object {}", id));
    }
  }
  for (const auto& [index, difficulty] : scene.predictions) {
    const int32_t track = kept_track("tracks_to_predict", index);
    if (track >= 0) out.tracks_to_predict.push_back({track, difficulty});
  }
}

namespace {

// A light, or several lights whose stop lines coincide and that always have equal states.
struct FoundLight {
  std::vector<int32_t> lanes;
  const LoggedLight* light;
  double heading_rad;  // heading of the controlled traffic
  LanePoint start;     // start of the light's widest lane
};

// Returns the lanes of a light, except lanes that the map does not have and bike lanes.
std::vector<int32_t> held_lanes(const LoggedLight& light, Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  std::vector<int32_t> lanes;
  for (const int64_t id : light.lanes) {
    const auto lane = conversion->lane_of_id.find(id);
    if (lane == conversion->lane_of_id.end()) {
      scene.note("lanes of lights that the map does not have", fmt::format("lane {}", id));
    } else if (conversion->out->map.lanes[lane->second].type == LaneType::biking) {
      scene.note("lights of bike lanes left out", fmt::format("lane {}", id));
    } else {
      lanes.push_back(lane->second);
    }
  }
  return lanes;
}

FoundLight find_light(const RoadMap& map, const LoggedLight& light, std::vector<int32_t> lanes) {
  // Mean direction of traffic at the stop line: of the preceding lanes if there are any, else of the lane itself.
  Eigen::Vector2d direction(0, 0);
  const auto add_heading = [&direction](double heading) {
    direction += Eigen::Vector2d(std::cos(heading), std::sin(heading));
  };
  LanePoint widest = map.points_of(map.lanes[lanes[0]])[0];
  for (const int32_t index : lanes) {
    const Lane& lane = map.lanes[index];
    const LanePoint start = map.points_of(lane)[0];
    if (start.width_m > widest.width_m) widest = start;
    const Span<const int32_t> before = map.links(lane.predecessors);
    for (const int32_t other : before) {
      const Span<const LanePoint> points = map.points_of(map.lanes[other]);
      add_heading(points[points.size() - 1].heading_rad);
    }
    if (before.empty()) add_heading(start.heading_rad);
  }
  return {std::move(lanes), &light, std::atan2(direction.y(), direction.x()), widest};
}

bool are_one(const FoundLight& a, const FoundLight& b) {
  return !a.light->has_stop_line && !b.light->has_stop_line && a.light->states == b.light->states &&
         length(a.start.position_m - b.start.position_m) < kSameStopPoint_m &&
         std::abs(std::remainder(a.heading_rad - b.heading_rad, 2 * std::numbers::pi)) < kSameHeading_rad;
}

// Returns the light with its stop line from left to right, but without its lanes.
RecordedLight recorded_light(const FoundLight& found, const Conversion& conversion) {
  RecordedLight recorded;
  recorded.stop_heading_rad = wrapped(found.heading_rad);
  if (found.light->has_stop_line) {
    for (const Eigen::Vector3d& p : {found.light->stop_a_m, found.light->stop_b_m}) {
      check_radius(conversion, "stop line", conversion.from_origin(p));
    }
    recorded.stop_a_m = to_vec3(conversion.from_origin(found.light->stop_a_m));
    recorded.stop_b_m = to_vec3(conversion.from_origin(found.light->stop_b_m));
    const Vec3 way = recorded.stop_b_m - recorded.stop_a_m;
    const double to_right = std::sin(found.heading_rad) * way.x - std::cos(found.heading_rad) * way.y;
    if (to_right < 0) std::swap(recorded.stop_a_m, recorded.stop_b_m);
  } else {
    const float half = 0.5f * max_of(found.start.width_m, kMinStopLine_m);
    const Vec3 left{-static_cast<float>(std::sin(found.heading_rad)) * half,
                    static_cast<float>(std::cos(found.heading_rad)) * half, 0};
    recorded.stop_a_m = found.start.position_m + left;
    recorded.stop_b_m = found.start.position_m - left;
  }
  return recorded;
}

}  // namespace

void make_lights(Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  Scenario& out = *conversion->out;
  std::vector<FoundLight> found;
  conversion->count_work(scene.lights.size() * static_cast<std::size_t>(scene.num_steps));
  for (const LoggedLight& light : scene.lights) {
    if (light.lanes.empty())
      scene.note("lights without lanes left out", fmt::format("light {}", &light - scene.lights.data()));
    std::vector<int32_t> lanes = held_lanes(light, conversion);
    if (lanes.empty()) continue;
    FoundLight one = find_light(out.map, light, std::move(lanes));
    conversion->count_work(found.size());
    const auto same = std::find_if(found.begin(), found.end(),
                                   [&](const FoundLight& other) { return !scene.is_authored && are_one(other, one); });
    if (same == found.end()) {
      found.push_back(std::move(one));
    } else {
      same->lanes.insert(same->lanes.end(), one.lanes.begin(), one.lanes.end());
      if (one.start.width_m > same->start.width_m) same->start = one.start;
    }
  }
  for (const FoundLight& light : found) {
    RecordedLight recorded = recorded_light(light, *conversion);
    recorded.lanes.begin = static_cast<int32_t>(out.light_lanes.size());
    out.light_lanes.insert(out.light_lanes.end(), light.lanes.begin(), light.lanes.end());
    recorded.lanes.end = static_cast<int32_t>(out.light_lanes.size());
    out.lights.push_back(recorded);
    PICTURA_CHECK(light.light->states.size() == static_cast<std::size_t>(scene.num_steps),
                  "{}: light: expected {} states, got {}", scene.source, scene.num_steps, light.light->states.size());
    out.light_states.insert(out.light_states.end(), light.light->states.begin(), light.light->states.end());
  }
}

}  // namespace conversion

Scenario make_scenario(LoggedScene scene) {
  Scenario scenario;
  scenario.id = scene.id;
  scenario.format = scene.format;
  scenario.dt_s = static_cast<float>(scene.dt_s);
  scenario.num_steps = scene.num_steps;
  scenario.current_step = scene.current_step;
  scenario.map.name = scene.name;
  conversion::Conversion conversion{scene, &scenario};
  try {
    conversion::choose_origin(&conversion);
    conversion::make_lanes(&conversion);
    conversion::link_lanes(&conversion);
    conversion::find_junctions(&conversion);
    find_endless_lanes(&scenario.map);
    conversion::make_edges(&conversion);
    conversion::make_markings(&conversion);
    conversion::make_signs(&conversion);
    conversion::make_tracks(&conversion);
    conversion::make_lights(&conversion);
    conversion::count_facts(&scenario.map);
    scenario.notes = std::move(scene.notes);
  } catch (const FieldError& error) {
    throw to_error(scene.source, error);
  }
  try {
    validate(scenario);
  } catch (const Error& error) {
    fail("{}: {}", scene.source, error.what());
  }
  return scenario;
}

}  // namespace pictura
