// Builds the paint of an OpenDRIVE network: lane marks, crosswalks, stop lines and parking spaces.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <set>

#include "pictura/common/hypot.h"
#include "pictura/map/opendrive/build.h"
#include "pictura/map/stripes.h"

namespace pictura::opendrive {

namespace {

constexpr double kDefaultMarkWidth_m = 0.125, kBoldMarkWidth_m = 0.25;
constexpr double kStopLineWidth_m = 0.4, kMinStopLine_m = 0.1, kMinParking_m = 0.1;
constexpr double kMinMarkLength_m = 0.05;
// Botts' dots: 4 inches wide, one every 48 inches.
constexpr double kDot_m = 0.1016, kDotPeriod_m = 1.2192;

// Maximum distance of corners that are merged.
constexpr float kSamePoint_m = 1e-3f;

/// One stripe of a mark, `left` metres from the border. Dashes begin at origin + i * period along the road; with
/// `once`, only i = 0 exists.
struct Stripe {
  double left = 0;
  double width = 0;
  MarkColor color = MarkColor::white;
  bool broken = false;
  double dash = 0, period = 0, origin = 0;
  bool once = false;
};

/// Returns the stripes of a mark's type. The two stripes of a double line are one width apart. The first word of the
/// type describes the stripe nearer to the centre lane. On the right side of the road, this is the left stripe.
std::vector<Stripe> stripes_of_type(const RoadMark& mark, int lane_id) {
  const double width = mark.width > 0 ? mark.width : mark.bold ? kBoldMarkWidth_m : kDefaultMarkWidth_m;
  const double inner = lane_id > 0 ? -width : width;
  // Dashes are counted from the road's start, so that they continue across sections and mark records.
  auto solid = [&](double left) { return Stripe{.left = left, .width = width, .color = mark.color}; };
  auto broken = [&](double left) {
    return Stripe{
        .left = left, .width = width, .color = mark.color, .broken = true, .dash = kDash_m, .period = kDashPeriod_m};
  };
  if (mark.type == "solid") return {solid(0)};
  if (mark.type == "broken") return {broken(0)};
  if (mark.type == "solid solid") return {solid(inner), solid(-inner)};
  if (mark.type == "broken broken") return {broken(inner), broken(-inner)};
  if (mark.type == "solid broken") return {solid(inner), broken(-inner)};
  if (mark.type == "broken solid") return {broken(inner), solid(-inner)};
  if (mark.type == "botts dots") {
    return {{.width = kDot_m, .color = mark.color, .broken = true, .dash = kDot_m, .period = kDotPeriod_m}};
  }
  return {};
}

/// Returns the stripes of a mark. Lines listed in the mark replace the pattern of its type. `begin` is the mark's s.
std::vector<Stripe> stripes_of(const RoadMark& mark, int lane_id, double begin) {
  if (mark.type == "none") return {};
  if (mark.lines.empty() && mark.explicit_lines.empty()) return stripes_of_type(mark, lane_id);
  std::vector<Stripe> stripes;
  auto add = [&](const MarkLine& line, bool once) {
    const double width = line.width > 0 ? line.width : mark.width > 0 ? mark.width : kDefaultMarkWidth_m;
    stripes.push_back({.left = line.t_offset,
                       .width = width,
                       .color = line.color.value_or(mark.color),
                       .broken = once || line.space > 0,
                       .dash = line.length,
                       .period = line.length + line.space,
                       .origin = begin + line.s_offset,
                       .once = once});
  };
  for (const MarkLine& line : mark.lines) add(line, false);
  for (const MarkLine& line : mark.explicit_lines) add(line, true);
  return stripes;
}

class MarkPainter {
 public:
  /// `recorded` has the offsets of marks whose repair is recorded, because several sections may have copies of a mark.
  MarkPainter(Build* build, std::size_t road, const FileSection& section, const FileLane& lane,
              std::set<std::ptrdiff_t>* recorded)
      : build_(*build),
        road_index_(road),
        road_(build->network.roads[road]),
        section_(section),
        lane_(lane),
        recorded_(*recorded) {}

  /// Paints the mark from `begin` to `end`.
  void paint(const RoadMark& mark, double begin, double end) {
    const double mark_begin = section_.s + mark.s_offset;
    for (const Stripe& stripe : stripes_of(mark, lane_.id, mark_begin)) {
      if (!stripe.broken) {
        add(mark, stripe, begin, end);
        continue;
      }
      const double last = stripe.once ? 0 : std::floor((end - stripe.origin) / stripe.period);
      for (double i = stripe.once ? 0 : std::floor((begin - stripe.origin) / stripe.period); i <= last; ++i) {
        build_.budget.count_sample();  // also for dashes that are too short to be painted
        const double dash_begin = stripe.origin + i * stripe.period;
        add(mark, stripe, std::max(dash_begin, begin), std::min(dash_begin + stripe.dash, end));
      }
    }
  }

 private:
  void add(const RoadMark& mark, const Stripe& stripe, double from, double to) {
    if (to - from < kMinMarkLength_m) return;
    CurveBreaks breaks = breaks_of(road_, section_, lane_.id, from, to, std::abs(stripe.left));
    if (!mark.sway.cubics.empty()) breaks.bend.clear();
    const double mark_begin = section_.s + mark.s_offset;
    for (const Cubic& sway : mark.sway.cubics) {
      if (mark_begin + sway.s > from && mark_begin + sway.s < to) breaks.s.push_back(mark_begin + sway.s);
    }
    std::sort(breaks.s.begin(), breaks.s.end());
    const std::vector<CurvePoint> points =
        sample_curve(breaks, build_.options.chord_error_m, kMaxPiece_m, &build_.budget, [&](double s) {
          const double t = border_at(road_, section_, lane_.id, s).t + stripe.left + mark.sway.value(s - mark_begin);
          Eigen::Vector3d p = point_at(road_, s, t, &build_.stations);
          // On a raised lane, the mark has the height of the lane's outer border.
          if (!lane_.inner_height.cubics.empty())
            p.z() = point_on_lane(road_, section_, lane_, s, 1, &build_.stations).z();
          return CurvePoint{s, p, 0};
        });
    // Omits the parts of a mark that would run backwards. A mark runs backwards on the inside of a bend if its offset
    // exceeds the bend's radius.
    std::size_t begin = 0;
    for (std::size_t i = 1; i < points.size(); ++i) {
      if (!runs_back(points[i - 1], points[i])) continue;
      note_self_crossing(mark, points[i - 1].s);
      add_marking(mark, stripe, points, begin, i);
      begin = i;
    }
    add_marking(mark, stripe, points, begin, points.size());
  }

  bool runs_back(const CurvePoint& a, const CurvePoint& b) const {
    const double heading = pose_at(road_, 0.5 * (a.s + b.s)).heading;
    return (b.position_m - a.position_m).head<2>().dot(Eigen::Vector2d{std::cos(heading), std::sin(heading)}) < 0;
  }

  void note_self_crossing(const RoadMark& mark, double s) {
    if (!recorded_.insert(mark.where.offset).second) return;
    mark.where.record_repair(build_.faults, RepairKind::self_crossing_mark, "at s {:.3f} it runs against the road", s);
  }

  /// Adds the points in [begin, end) if they form a line.
  void add_marking(const RoadMark& mark, const Stripe& stripe, const std::vector<CurvePoint>& points, std::size_t begin,
                   std::size_t end) {
    if (end - begin < 2) return;
    RoadMap& map = *build_.map;
    const int32_t first = static_cast<int32_t>(map.marking_points.size());
    for (std::size_t i = begin; i < end; ++i) map.marking_points.push_back(build_.to_map(points[i].position_m));
    map.markings.push_back({{first, static_cast<int32_t>(map.marking_points.size())},
                            static_cast<float>(stripe.width),
                            stripe.color,
                            stripe.broken});
    map.provenance.markings.push_back(source_of(road_index_, mark.where));
  }

  Build& build_;
  std::size_t road_index_;
  const FileRoad& road_;
  const FileSection& section_;
  const FileLane& lane_;
  std::set<std::ptrdiff_t>& recorded_;
};

/// Returns the corners of an object: its outline, or its bounding box.
std::vector<Vec3> corners_of(Build* build, const FileRoad& road, const FileObject& object) {
  std::vector<FileObject::Corner> corners = object.outline;
  if (corners.empty()) {
    const double u = 0.5 * object.length, v = 0.5 * object.width;
    corners = {{u, v}, {-u, v}, {-u, -v}, {u, -v}};
  }
  const Eigen::Vector3d origin = point_at(road, object.s, object.t);
  const double heading = pose_at(road, object.s).heading + object.heading;
  std::vector<Vec3> points;
  for (const FileObject::Corner& corner : corners) {
    Eigen::Vector3d p;
    if (corner.along_road) {
      p = point_at(road, corner.u, corner.v);
      p.z() += corner.z;
    } else {
      const Eigen::Vector2d forward{std::cos(heading), std::sin(heading)}, left{-forward.y(), forward.x()};
      p.head<2>() = origin.head<2>() + corner.u * forward + corner.v * left;
      p.z() = origin.z() + object.z_offset + corner.z;
    }
    const Vec3 point = build->to_map(p);
    if (points.empty() || length(point - points.back()) > kSamePoint_m) points.push_back(point);
  }
  if (points.size() > 1 && length(points.back() - points.front()) <= kSamePoint_m) points.pop_back();
  return points;
}

void add_crosswalk(Build* build, std::size_t road, const FileObject& object) {
  if (object.outline.empty() && !(object.length > 0 && object.width > 0)) {
    return object.where.record_repair(build->faults, RepairKind::shapeless_object,
                                      "expected a crosswalk with an outline, or a length and a width");
  }
  const std::vector<Vec3> corners = corners_of(build, build->network.roads[road], object);
  if (corners.size() < 3) {
    return object.where.record_repair(build->faults, RepairKind::shapeless_object,
                                      "expected a crosswalk with at least three distinct corners, got {}",
                                      corners.size());
  }
  RoadMap& map = *build->map;
  const int32_t first = static_cast<int32_t>(map.outline_points.size());
  map.outline_points.insert(map.outline_points.end(), corners.begin(), corners.end());
  map.crosswalks.push_back({{first, static_cast<int32_t>(map.outline_points.size())}});
  map.provenance.crosswalks.push_back(source_of(road, object.where));
}

/// Adds a stop line along the longer extent of the corners, in the middle of the shorter extent. The shorter extent is
/// the line's width.
void add_stop_line(Build* build, std::size_t road, const FileObject& object) {
  constexpr std::size_t kMaxCorners = 64;
  const std::vector<Vec3> corners = corners_of(build, build->network.roads[road], object);
  if (corners.size() > kMaxCorners) {
    return object.where.record_repair(build->faults, RepairKind::shapeless_object,
                                      "expected a stop line of at most {} corners, got {}", kMaxCorners,
                                      corners.size());
  }
  Vec2 along{};
  for (const Vec3 a : corners) {
    for (const Vec3 b : corners) {
      if (length((b - a).xy()) > length(along)) along = (b - a).xy();
    }
  }
  if (length(along) < kMinStopLine_m) {
    return object.where.record_repair(build->faults, RepairKind::shapeless_object,
                                      "expected a stop line at least {} m long, got {}", kMinStopLine_m, length(along));
  }
  if (corners.size() >= 4) {
    // The longest extent of a box is its diagonal, so its longest side is used.
    along = {};
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec2 side = (corners[(i + 1) % corners.size()] - corners[i]).xy();
      if (length(side) > length(along)) along = side;
    }
  }
  along = along * (1.0f / length(along));
  float low = 0, high = 0, left = 0, right = 0, z_low = corners[0].z, z_high = corners[0].z;
  for (const Vec3 corner : corners) {
    const Vec2 from_first = (corner - corners[0]).xy();
    const float u = dot(from_first, along), v = cross(along, from_first);
    if (u < low) z_low = corner.z;
    if (u > high) z_high = corner.z;
    low = min_of(low, u);
    high = max_of(high, u);
    left = max_of(left, v);
    right = min_of(right, v);
  }
  const Vec2 middle = corners[0].xy() + left_normal(along) * (0.5f * (left + right));
  const Vec2 a = middle + along * low, b = middle + along * high;
  const float width_m = left - right > 0.05f ? left - right : static_cast<float>(kStopLineWidth_m);
  build->map->stop_lines.push_back({{a.x, a.y, z_low}, {b.x, b.y, z_high}, width_m});
  build->map->provenance.stop_lines.push_back(source_of(road, object.where));
}

/// Returns the stretch of a deformed road in a direction: deformed metres per original metre. `angle` is the direction
/// relative to the road's heading.
double stretch_towards(const Pose& pose, double angle) {
  return hypot_of(pose.stretch * std::cos(angle), std::sin(angle));
}

void add_parking_space(Build* build, std::size_t road_index, const FileObject& object) {
  const FileRoad& road = build->network.roads[road_index];
  ParkingSpace space;
  Eigen::Vector3d center = point_at(road, object.s, object.t);
  center.z() += object.z_offset;
  space.center_m = build->to_map(center);
  const Pose pose = pose_at(road, object.s);
  double heading = pose.heading + object.heading;
  double length_m = object.length, width_m = object.width;
  if (!(length_m >= kMinParking_m && width_m >= kMinParking_m)) {
    return object.where.record_repair(
        build->faults, RepairKind::shapeless_object,
        "expected a parking space with a length and a width of at least {} m, got {} and {}", kMinParking_m, length_m,
        width_m);
  }
  // Each space stretches with the road, so that rows along the road keep their number of spaces.
  if (road.deformation) {
    length_m *= stretch_towards(pose, object.heading);
    width_m *= stretch_towards(pose, object.heading + 0.5 * std::numbers::pi);
  }
  // Cars park along the longer side, even if the file calls it width.
  if (width_m > length_m) {
    std::swap(width_m, length_m);
    heading += 0.5 * std::numbers::pi;
  }
  // The space gets that of the two opposite headings which is closer to the traffic on this side of the road.
  const bool forward = travels_forward(road, object.t > 0 ? 1 : -1);
  const double traffic = pose.heading + (forward ? 0.0 : std::numbers::pi);
  if (std::cos(heading - traffic) < 0) heading += std::numbers::pi;
  space.heading_rad = static_cast<float>(std::remainder(heading, 2 * std::numbers::pi));
  space.length_m = static_cast<float>(length_m);
  space.width_m = static_cast<float>(width_m);
  build->map->parking_spaces.push_back(space);
  build->map->provenance.parking_spaces.push_back(source_of(road_index, object.where));
}

void add_object(Build* build, std::size_t road, const FileObject& object) {
  switch (object.kind) {
    case FileObject::Kind::crosswalk: return add_crosswalk(build, road, object);
    case FileObject::Kind::parking_space: return add_parking_space(build, road, object);
    case FileObject::Kind::stop_line: return add_stop_line(build, road, object);
  }
}

}  // namespace

void build_markings(Build* build) {
  std::set<std::ptrdiff_t> recorded;
  for (std::size_t road = 0; road < build->network.roads.size(); ++road) {
    for (const FileSection& section : build->network.roads[road].sections) {
      auto add_lane = [&](const FileLane& lane) {
        MarkPainter painter(build, road, section, lane, &recorded);
        for (std::size_t i = 0; i < lane.marks.size(); ++i) {
          const double begin = section.s + std::max(0.0, lane.marks[i].s_offset);
          const double end = i + 1 < lane.marks.size() ? section.s + lane.marks[i + 1].s_offset : section.end;
          if (end > begin) painter.paint(lane.marks[i], begin, std::min(end, section.end));
        }
      };
      add_lane(section.center);
      for (const FileLane& lane : section.left) add_lane(lane);
      for (const FileLane& lane : section.right) add_lane(lane);
    }
  }
}

void build_objects(Build* build) {
  for (std::size_t road = 0; road < build->network.roads.size(); ++road) {
    for (const FileObject& object : build->network.roads[road].objects) {
      build->budget.work().check();
      add_object(build, road, object);
    }
  }
}

}  // namespace pictura::opendrive
