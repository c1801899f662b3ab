// Road edges of an OpenDRIVE network: its drivable lanes as bands of surface, and the outline of their union.
#include <algorithm>
#include <cmath>

#include "pictura/map/opendrive_build.h"
#include "pictura/map/road_edges.h"

namespace pictura::opendrive {

namespace {

// Bands are the surface itself, so they follow it much more closely than what is drawn of it.
constexpr double kBandChordError_m = 0.001;
constexpr double kBandPiece_m = 2.0;

}  // namespace

void build_road_edges(Build* build) {
  std::vector<SurfaceBand> bands;
  for (const FileRoad& road : build->network.roads) {
    for (const FileSection& section : road.sections) {
      auto add_lane = [&](const FileLane& lane) {
        if (!is_drivable(lane.type)) return;
        const int left = lane.id > 0 ? lane.id : lane.id + 1, right = lane.id > 0 ? lane.id - 1 : lane.id;
        auto border = [&](int which, double s) {
          const Point3 p = point_at(road, s, border_t(road, section, which, s));
          return Point3{p.x - build->map->origin_m[0], p.y - build->map->origin_m[1], p.z - build->map->origin_m[2]};
        };
        // Both borders get the same stations, the union of what either needs.
        const std::vector<double> breaks = formula_changes(road, section, lane.id, section.s, section.end);
        std::vector<double> stations;
        for (const int which : {left, right}) {
          for (const CurvePoint& point :
               sample_curve(breaks, kBandChordError_m, kBandPiece_m, &build->budget, [&](double s) {
                 const Point3 p = border(which, s);
                 return CurvePoint{s, p.x, p.y, p.z, 0};
               })) {
            stations.push_back(point.s);
          }
        }
        std::sort(stations.begin(), stations.end());
        SurfaceBand band;
        double previous = -1;
        for (const double s : stations) {
          if (s - previous < 1e-4) continue;
          band.left.push_back(border(left, s));
          band.right.push_back(border(right, s));
          previous = s;
        }
        if (band.left.size() >= 2) bands.push_back(std::move(band));
      };
      for (const FileLane& lane : section.left) add_lane(lane);
      for (const FileLane& lane : section.right) add_lane(lane);
    }
  }
  build->map->road_edges = outline_of(bands, build->options.chord_error_m);
}

}  // namespace pictura::opendrive
