// Stages of make_scenario(), in the order of execution. docs/reference/scenario.md lists the rules.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/grid.h"
#include "pictura/map/polyline.h"
#include "pictura/map/polyline_lanes.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/scenario/scenario_fields.h"

namespace pictura::conversion {

/// Closer successive points are duplicates.
constexpr double kSamePoint_m = 0.01;

struct Conversion {
  LoggedScene& scene;
  Scenario* out;
  Eigen::Vector3d origin{0, 0, 0};
  std::vector<std::size_t> logged_lane{};             // [map.lanes] index into scene.lanes
  std::unordered_map<int64_t, int32_t> lane_of_id{};  // index into map.lanes
  int64_t remaining_work = 400'000'000;               // steps left for loops whose length depends on a file

  /// Throws Error at the limit, so that no file can take minutes.
  void count_work(std::size_t amount) {
    remaining_work -= static_cast<int64_t>(amount);
    if (remaining_work < 0) fail("{}: its map exceeds the work limit of a scene", scene.source);
  }
  Eigen::Vector3d from_origin(const Eigen::Vector3d& p) const { return p - origin; }
  /// Rounds points of authored scenes (LoggedScene::is_authored) to a map's floats, so that scene_of_scenario() returns
  /// the same points.
  Eigen::Vector3d rounded(const Eigen::Vector3d& p) const {
    if (!scene.is_authored) return p;
    const Eigen::Vector3d stated_again = origin + p.cast<float>().cast<double>();
    return (stated_again - origin).cast<float>().cast<double>();
  }
};

/// Removes duplicate points, and inserts points so that no piece is too long. `what` is the line's name in notes.
std::vector<CurvePoint> cut_into_pieces(Conversion* conversion, const std::vector<CurvePoint>& points,
                                        const std::string& what);

/// Returns a line relative to the origin, cut into pieces and thinned. The line is empty if there are fewer than two
/// points. Throws Error, which names `what`, if a point is too far from the origin.
std::vector<CurvePoint> resampled(Conversion* conversion, const LoggedPoints& points, const std::vector<double>& widths,
                                  const std::string& what);

/// Sets the origin to the centre of lanes and edges, in whole metres, unless the scene has an origin.
void choose_origin(Conversion* conversion);
void make_lanes(Conversion* conversion);
void link_lanes(Conversion* conversion);
void find_junctions(Conversion* conversion);
void make_edges(Conversion* conversion);
void make_markings(Conversion* conversion);
void make_signs(Conversion* conversion);
void make_tracks(Conversion* conversion);
void make_lights(Conversion* conversion);
void count_facts(RoadMap* map);

}  // namespace pictura::conversion
