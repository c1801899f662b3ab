// Builds the paint of a Lanelet2 map: lines with their dashes, stop lines and parking spaces.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "pictura/common/scene.h"
#include "pictura/common/support/numbers.h"
#include "pictura/map/lanelet2/build.h"
#include "pictura/map/stripes.h"

namespace pictura::lanelet2 {

namespace {

constexpr double kThinLine_m = 0.12, kThickLine_m = 0.25;
constexpr double kStopLine_m = 0.4;
constexpr double kMinLine_m = 0.1, kMinMarkLength_m = 0.05;
constexpr double kWorkPerSample = 64;

class Painter {
 public:
  explicit Painter(Build* build) : build_(*build), map_(*build->map), file_(build->file) {}

  void run() {
    for (const Lanelet& lanelet : build_.lanelets) {
      if (lanelet.road < 0) crosswalk_borders_.insert({lanelet.left.way, lanelet.right.way});
    }
    for (std::size_t i = 0; i < file_.ways.size(); ++i) {
      if (file_.ways[i].nodes.size() < 2) continue;
      build_.budget.work().check();
      add_way(static_cast<int32_t>(i));
    }
  }

 private:
  void add_way(int32_t index) {
    const Way& way = file_.ways[index];
    const std::string_view type = way.tags.of("type");
    if (type == "line_thin") return add_line(index, kThinLine_m, way.tags.of("subtype"));
    if (type == "line_thick") return add_line(index, kThickLine_m, way.tags.of("subtype"));
    if (type == "bike_marking") return add_line(index, kThinLine_m, "dashed");
    // The borders of a crosswalk get no line here, because the crosswalk's outline is drawn.
    if (type == "pedestrian_marking" && !crosswalk_borders_.contains(index)) {
      return add_line(index, kThinLine_m, "solid");
    }
    if (type == "stop_line") add_stop_line(index);
    if (type == "parking_space") add_parking_space(index);
  }

  /// Returns the value of the tag `width` in metres, or 0 if it is missing or outside [0.01, high_m].
  double width_of(const Way& way, double high_m) const {
    const std::optional<double> width_m = parse_written_number(way.tags.of("width"));
    return width_m && *width_m >= 0.01 && *width_m <= high_m ? *width_m : 0;
  }

  MarkColor color_of(const Way& way) const {
    const std::string_view name = way.tags.of("color");
    if (name.empty()) return MarkColor::white;
    for (int i = 0; i <= static_cast<int>(MarkColor::black); ++i) {
      if (name == to_string(static_cast<MarkColor>(i))) return static_cast<MarkColor>(i);
    }
    file_.where(way).record_repair(build_.faults, RepairKind::unknown_color, "tag color: '{}' is not known", name);
    return MarkColor::white;
  }

  void add_line(int32_t index, double default_width_m, std::string_view subtype) {
    const Way& way = file_.ways[index];
    const std::vector<CurvePoint> line = cut_line(build_.points_of(index), &build_.budget);
    if (line.size() < 2) return;
    const double stated_m = width_of(way, 2);
    const Stripe stripe{index, stated_m > 0 ? stated_m : default_width_m, color_of(way)};
    const bool is_dashed = subtype.starts_with("dashed");
    const std::size_t second = subtype.find('_');
    if (second == std::string_view::npos) return add_stripe(stripe, line, is_dashed);
    // The first word of a double line's subtype describes its left stripe.
    add_stripe(stripe, moved_left(line, stripe.width_m), is_dashed);
    add_stripe(stripe, moved_left(line, -stripe.width_m), subtype.substr(second + 1).starts_with("dashed"));
  }

  struct Stripe {
    int32_t way = -1;
    double width_m = 0;
    MarkColor color = MarkColor::white;
  };

  void add_stripe(const Stripe& stripe, const std::vector<CurvePoint>& line, bool is_dashed) {
    if (!is_dashed) return add_marking(stripe, line, false);
    const double length_m = plan_length_m(line);
    const std::vector<std::pair<double, double>> stated = stated_dashes(stripe.way);
    for (const auto& [begin, end] : stated) {
      build_.count_work(line.size());  // a pass over the whole line
      add_marking(stripe, part_of(line, begin * length_m, end * length_m), true);
    }
    if (!stated.empty()) return;
    // Building each dash takes a pass over the whole line.
    for (double work = 0; work < length_m / kDashPeriod_m * static_cast<double>(line.size()); work += kWorkPerSample) {
      build_.budget.count_sample();
    }
    for (const std::vector<CurvePoint>& dash : dashes_of(line)) add_marking(stripe, dash, true);
  }

  /// Returns where dashes begin and end according to tags of the line's points, as fractions of the line's length.
  std::vector<std::pair<double, double>> stated_dashes(int32_t index) {
    const Way& way = file_.ways[index];
    const Points points = build_.points_of(index);
    std::vector<double> at_m{0};
    for (std::size_t i = 1; i < points.size(); ++i) {
      at_m.push_back(at_m.back() + plan_distance_m(points[i - 1], points[i]));
    }
    std::vector<std::pair<double, double>> dashes;
    double begin_m = -1;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const DashMark mark = file_.nodes[way.nodes[i]].dash;
      if (mark == DashMark::begin) begin_m = at_m[i];
      if (mark != DashMark::end || begin_m < 0) continue;
      dashes.emplace_back(begin_m / at_m.back(), at_m[i] / at_m.back());
      begin_m = -1;
    }
    return dashes;
  }

  void add_marking(const Stripe& stripe, const std::vector<CurvePoint>& line, bool is_broken) {
    if (line.size() < 2 || plan_length_m(line) < kMinMarkLength_m) return;
    const auto first = static_cast<int32_t>(map_.marking_points.size());
    for (const std::size_t index : thin_polyline(line, double{build_.options.chord_error_m}, double{kMaxPiece_m})) {
      build_.budget.count_sample();
      map_.marking_points.push_back(to_vec3(line[index].position_m));
    }
    map_.markings.push_back({{first, static_cast<int32_t>(map_.marking_points.size())},
                             static_cast<float>(stripe.width_m),
                             stripe.color,
                             is_broken});
    map_.provenance.markings.push_back(build_.source_of(-1, file_.ways[stripe.way].offset));
  }

  void add_stop_line(int32_t index) {
    const Way& way = file_.ways[index];
    const Points points = build_.points_of(index);
    if (plan_distance_m(points.front(), points.back()) < kMinLine_m) return;
    const double stated_m = width_of(way, 5);
    map_.stop_lines.push_back(
        {to_vec3(points.front()), to_vec3(points.back()), static_cast<float>(stated_m > 0 ? stated_m : kStopLine_m)});
    map_.provenance.stop_lines.push_back(build_.source_of(-1, way.offset));
  }

  /// Adds Autoware's parking space: a line along the space, with the space's width as a tag.
  void add_parking_space(int32_t index) {
    const Way& way = file_.ways[index];
    const Points points = build_.points_of(index);
    const Eigen::Vector3d along = points.back() - points.front();
    double length_m = along.head<2>().norm(), width_m = width_of(way, 100);
    if (length_m < kMinLine_m || width_m < kMinLine_m) {
      return file_.where(way).record_repair(build_.faults, RepairKind::shapeless_object,
                                            "expected a parking space with a length and a width of at least {} m",
                                            kMinLine_m);
    }
    double heading = std::atan2(along.y(), along.x());
    if (width_m > length_m) {
      std::swap(width_m, length_m);
      heading += 0.5 * std::numbers::pi;
    }
    map_.parking_spaces.push_back({to_vec3((0.5 * (points.front() + points.back())).eval()),
                                   static_cast<float>(std::remainder(heading, 2 * std::numbers::pi)),
                                   static_cast<float>(length_m), static_cast<float>(width_m)});
    map_.provenance.parking_spaces.push_back(build_.source_of(-1, way.offset));
  }

  Build& build_;
  RoadMap& map_;
  const OsmFile& file_;
  std::set<int32_t> crosswalk_borders_;
};

}  // namespace

void build_paint(Build* build) { Painter(build).run(); }

}  // namespace pictura::lanelet2
