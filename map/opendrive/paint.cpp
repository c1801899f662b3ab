// What is painted on the roads of an OpenDRIVE network: lane marks, crosswalks, parking spaces.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pictura/map/opendrive/build.h"

namespace pictura::opendrive {

namespace {

constexpr double kDefaultMarkWidth_m = 0.125;
constexpr double kMinMarkLength_m = 0.05;
// Dashes of 3 m with gaps of 9 m, the pattern of North American roads, which CARLA's towns imitate.
constexpr double kDash_m = 3.0, kDashPeriod_m = 12.0;

// Corners nearer to each other than this are one.
constexpr float kSamePoint_m = 1e-3f;

/// One stripe of a mark: how far its middle lies left of the border, in mark widths, and whether it is broken.
struct Stripe {
  double left_widths = 0;
  bool broken = false;
};

/// The stripes of a mark's type. Double lines leave one width between their stripes; the first word names the stripe
/// nearer to the center lane, which is to the left on the right side of the road.
std::vector<Stripe> stripes_of(const std::string& type, int lane_id) {
  const double inner = lane_id > 0 ? -1.0 : 1.0;
  if (type == "solid") return {{0, false}};
  if (type == "broken") return {{0, true}};
  if (type == "solid solid") return {{inner, false}, {-inner, false}};
  if (type == "broken broken") return {{inner, true}, {-inner, true}};
  if (type == "solid broken") return {{inner, false}, {-inner, true}};
  if (type == "broken solid") return {{inner, true}, {-inner, false}};
  return {};
}

void add_mark(Build* build, const FileRoad& road, const FileSection& section, const FileLane& lane,
              const RoadMark& mark, double begin, double end) {
  const double width = mark.width > 0 ? mark.width : kDefaultMarkWidth_m;
  RoadMap& map = *build->map;
  for (const Stripe& stripe : stripes_of(mark.type, lane.id)) {
    const double period = stripe.broken ? kDashPeriod_m : end - begin;
    const double dash = stripe.broken ? kDash_m : end - begin;
    // Dashes are counted from the road's start, so that they run on across sections and changes of mark.
    double dash_begin = stripe.broken ? std::floor(begin / period) * period : begin;
    for (; dash_begin < end; dash_begin += period) {
      const double from = std::max(dash_begin, begin), to = std::min(dash_begin + dash, end);
      if (to - from < kMinMarkLength_m) continue;
      const std::vector<CurvePoint> points = sample_curve(
          formula_changes(road, section, lane.id, from, to), build->options.chord_error_m, kMaxPiece_m, &build->budget,
          [&](double s) {
            const Point3 p = point_at(road, s, border_t(road, section, lane.id, s) + stripe.left_widths * width);
            return CurvePoint{s, p.x, p.y, p.z, 0};
          });
      const int32_t first = static_cast<int32_t>(map.marking_points.size());
      for (const CurvePoint& point : points) map.marking_points.push_back(build->to_map(point.x, point.y, point.z));
      map.markings.push_back({{first, static_cast<int32_t>(map.marking_points.size())},
                              static_cast<float>(width),
                              mark.color,
                              stripe.broken});
    }
  }
}

void add_crosswalk(Build* build, const FileRoad& road, const FileObject& object) {
  std::vector<FileObject::Corner> corners = object.outline;
  if (corners.empty()) {
    const double u = 0.5 * object.length, v = 0.5 * object.width;
    if (u <= 0 || v <= 0) object.where.fail("expected a crosswalk with an outline, or a length and a width");
    corners = {{u, v}, {-u, v}, {-u, -v}, {u, -v}};
  }
  const Point3 origin = point_at(road, object.s, object.t);
  const double heading = pose_at(road, object.s).heading + object.heading;
  RoadMap& map = *build->map;
  const std::size_t first = map.outline_points.size();
  for (const FileObject::Corner& corner : corners) {
    Point3 p;
    if (corner.along_road) {
      p = point_at(road, corner.u, corner.v);
      p.z += corner.z;
    } else {
      p = {origin.x + corner.u * std::cos(heading) - corner.v * std::sin(heading),
           origin.y + corner.u * std::sin(heading) + corner.v * std::cos(heading),
           origin.z + object.z_offset + corner.z};
    }
    const Vec3 point = build->to_map(p);
    if (map.outline_points.size() == first || length(point - map.outline_points.back()) > kSamePoint_m) {
      map.outline_points.push_back(point);
    }
  }
  if (map.outline_points.size() > first + 1 &&
      length(map.outline_points.back() - map.outline_points[first]) <= kSamePoint_m) {
    map.outline_points.pop_back();
  }
  if (map.outline_points.size() < first + 3) {
    object.where.fail("expected a crosswalk with at least three distinct corners, got {}",
                      map.outline_points.size() - first);
  }
  map.crosswalks.push_back({{static_cast<int32_t>(first), static_cast<int32_t>(map.outline_points.size())}});
}

void add_parking_space(Build* build, const FileRoad& road, const FileObject& object) {
  ParkingSpace space;
  Point3 center = point_at(road, object.s, object.t);
  center.z += object.z_offset;
  space.center_m = build->to_map(center);
  double heading = pose_at(road, object.s).heading + object.heading;
  double length_m = object.length, width_m = object.width;
  if (!(length_m > 0 && width_m > 0)) object.where.fail("expected a parking space with a length and a width");
  // Cars stand along the longer side, whichever the file calls its length.
  if (width_m > length_m) {
    std::swap(width_m, length_m);
    heading += 0.5 * std::numbers::pi;
  }
  // Of the two ways to stand in it: the one of the traffic on this side of the road.
  const double traffic = pose_at(road, object.s).heading + (object.t > 0 ? std::numbers::pi : 0.0);
  if (std::cos(heading - traffic) < 0) heading += std::numbers::pi;
  space.heading_rad = static_cast<float>(std::remainder(heading, 2 * std::numbers::pi));
  space.length_m = static_cast<float>(length_m);
  space.width_m = static_cast<float>(width_m);
  build->map->parking_spaces.push_back(space);
}

}  // namespace

void build_markings(Build* build) {
  for (const FileRoad& road : build->network.roads) {
    for (const FileSection& section : road.sections) {
      auto add_lane = [&](const FileLane& lane) {
        for (std::size_t i = 0; i < lane.marks.size(); ++i) {
          const double begin = section.s + std::max(0.0, lane.marks[i].s_offset);
          const double end = i + 1 < lane.marks.size() ? section.s + lane.marks[i + 1].s_offset : section.end;
          if (end > begin) add_mark(build, road, section, lane, lane.marks[i], begin, std::min(end, section.end));
        }
      };
      add_lane(section.center);
      for (const FileLane& lane : section.left) add_lane(lane);
      for (const FileLane& lane : section.right) add_lane(lane);
    }
  }
}

void build_objects(Build* build) {
  for (const FileRoad& road : build->network.roads) {
    for (const FileObject& object : road.objects) {
      if (object.type == "crosswalk") {
        add_crosswalk(build, road, object);
      } else {
        add_parking_space(build, road, object);
      }
    }
  }
}

}  // namespace pictura::opendrive
