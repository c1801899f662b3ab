// Builds road edges and building lines of an OpenDRIVE network. Lane surfaces are bands. Road edges are the outline of
// the drivable lanes. Building lines are on free ground.
#include <algorithm>
#include <array>
#include <cmath>

#include "pictura/map/open_lanes.h"
#include "pictura/map/opendrive/build.h"
#include "pictura/map/road_edges.h"

namespace pictura::opendrive {

namespace {

// Chord error of the bands for road edges, which must be much more precise than the drawn surface.
constexpr double kEdgeBandChordError_m = 0.001;
// Chord error of the bands for building lines. It may be larger, because buildings keep a clearance from the surface.
constexpr double kLotBandChordError_m = 0.05;
constexpr double kBandPiece_m = 5.0;

constexpr double kSetback_m = 1.0;    // distance of a building from the outermost lane
constexpr double kLotDepth_m = 6.0;   // depth of free ground behind a building's line
constexpr double kClearance_m = 0.5;  // distance of a building, also of its ends, from any surface
constexpr double kProbeStep_m = 1.0;
constexpr double kBuildingPiece_m = 8.0;  // length of a piece of a building line
constexpr double kAnyLevel_m = 1e9;

SurfaceBand lane_band(Build* build, const FileRoad& road, const FileSection& section, const FileLane& lane,
                      double chord_error_m) {
  const double left = lane.id > 0 ? 1 : 0, right = 1 - left;  // 0: inner border, 1: outer border
  auto border = [&](double outer_fraction, double s) {
    return build->from_origin(point_on_lane(road, section, lane, s, outer_fraction, &build->stations));
  };
  // Each border is sampled at the stations that it needs; the band uses the stations of both borders.
  const CurveBreaks breaks = breaks_of(road, section, lane.id, section.s, section.end);
  std::array<std::vector<CurvePoint>, 2> sampled;
  std::vector<double> stations;
  for (std::size_t i = 0; i < 2; ++i) {
    const double side = i == 0 ? left : right;
    sampled[i] = sample_curve(breaks, chord_error_m, kBandPiece_m, &build->budget,
                              [&](double s) { return CurvePoint{s, border(side, s), 0}; });
    for (const CurvePoint& point : sampled[i]) stations.push_back(point.s);
  }
  std::sort(stations.begin(), stations.end());
  std::array<std::size_t, 2> next{};
  const auto point_at_station = [&](std::size_t i, double s) {
    while (next[i] < sampled[i].size() && sampled[i][next[i]].s < s) ++next[i];
    const bool is_sampled = next[i] < sampled[i].size() && sampled[i][next[i]].s == s;
    return is_sampled ? sampled[i][next[i]].position_m : border(i == 0 ? left : right, s);
  };
  SurfaceBand band;
  double previous = -1;
  for (const double s : stations) {
    if (s - previous < 1e-4) continue;
    band.left.push_back(point_at_station(0, s));
    band.right.push_back(point_at_station(1, s));
    previous = s;
  }
  return band;
}

/// Returns one band for each selected lane of the map. If roads_out is not null, it receives the road of each band.
template <typename IsSelected>
std::vector<SurfaceBand> lane_bands(Build* build, double chord_error_m, std::vector<int32_t>* roads_out,
                                    IsSelected&& is_selected) {
  std::vector<SurfaceBand> bands;
  for (std::size_t i = 0; i < build->map->lanes.size(); ++i) {
    const int32_t road = build->map->lanes[i].source_road;
    const auto [section, lane] = build->file_lanes[i];
    if (!is_selected(*lane)) continue;
    SurfaceBand band = lane_band(build, build->network.roads[road], *section, *lane, chord_error_m);
    if (band.left.size() < 2) continue;
    bands.push_back(std::move(band));
    if (roads_out) roads_out->push_back(road);
  }
  return bands;
}

/// Returns the id of the outermost lane with a surface, or 0.
int outermost_lane(const std::vector<FileLane>& side) {
  for (std::size_t i = side.size(); i-- > 0;) {
    if (!side[i].is_void) return side[i].id;
  }
  return 0;
}

/// Whether the ground for a building along a-b is free: no surface is on it, near it, or up to kLotDepth_m behind it.
/// The road is to the right of a-b.
bool is_free(const Surface& surface, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double length_m = plan_distance_m(a, b);
  const Eigen::Vector2d along = (b - a).head<2>() / length_m, left{-along.y(), along.x()};
  const int steps = static_cast<int>(std::ceil((length_m + 2 * kClearance_m) / kProbeStep_m));
  for (int i = 0; i <= steps; ++i) {
    const double u = -kClearance_m + (length_m + 2 * kClearance_m) * i / steps;
    for (double depth = -kClearance_m; depth <= kLotDepth_m; depth += kProbeStep_m) {
      const Eigen::Vector2d probe = a.head<2>() + u * along + depth * left;
      if (surface.any_band_at(probe, 0, [](int32_t) { return true; })) return false;
    }
  }
  return true;
}

}  // namespace

void build_road_edges(Build* build) {
  std::vector<int32_t> roads, bands_of_edges;
  const std::vector<SurfaceBand> bands =
      lane_bands(build, kEdgeBandChordError_m, &roads, [](const FileLane& lane) { return is_drivable(lane.type); });
  build->map->road_edges = outline_of(bands, build->options.chord_error_m, &bands_of_edges);
  for (const int32_t band : bands_of_edges) {
    build->map->provenance.road_edges.push_back({roads[band], 0});
  }
}

void open_road_ends(Build* build) {
  const RoadMap& map = *build->map;
  const OpenLanes open = find_open_lanes(map);
  for (const OpenLanes::MissingLink& link : open.missing_links) {
    const Lane& to = map.lanes[link.to];
    build->file_lanes[link.from].lane->where.record_repair(
        build->faults, RepairKind::missing_link,
        "ends {:.2f} m from the start of lane {} of road {}, to which it has no link", link.gap_m, to.source_lane,
        map.road_names[to.source_road]);
  }
  remove_edges_across_openings(open, build->map);
}

void build_building_lines(Build* build) {
  const Surface surface(lane_bands(build, kLotBandChordError_m, nullptr, [](const FileLane&) { return true; }),
                        kAnyLevel_m);
  for (std::size_t r = 0; r < build->network.roads.size(); ++r) {
    const FileRoad& road = build->network.roads[r];
    if (!road.junction.empty()) continue;
    for (const FileSection& section : road.sections) {
      for (const int sign : {1, -1}) {
        const int outermost = outermost_lane(sign > 0 ? section.left : section.right);
        if (outermost == 0) continue;
        auto at = [&](double s) {
          return build->from_origin(point_at(road, s, border_at(road, section, outermost, s).t + sign * kSetback_m));
        };
        const int pieces =
            std::max(1, static_cast<int>(std::round(length_between(road, section.s, section.end) / kBuildingPiece_m)));
        const double step = (section.end - section.s) / pieces;
        for (int i = 0; i < pieces; ++i) {
          build->budget.count_sample();
          // The line is directed so that the road is to its right.
          const double low = section.s + i * step, high = i + 1 == pieces ? section.end : section.s + (i + 1) * step;
          const Eigen::Vector3d a = at(sign > 0 ? low : high), b = at(sign > 0 ? high : low);
          const double length_m = plan_distance_m(a, b);
          if (length_m < 2 * kClearance_m || length_m > kMaxPiece_m || !is_free(surface, a, b)) continue;
          // Skips lines that run backwards, as on the inside of a bend whose radius is smaller than the line's offset.
          const double heading = pose_at(road, 0.5 * (low + high)).heading;
          const Eigen::Vector2d forward{std::cos(heading), std::sin(heading)};
          if (sign * (b - a).head<2>().dot(forward) < 0.5 * length_m) continue;
          build->map->building_lines.push_back({to_vec3(a), to_vec3(b)});
          build->map->provenance.building_lines.push_back({static_cast<int32_t>(r), 0});
        }
      }
    }
  }
}

}  // namespace pictura::opendrive
