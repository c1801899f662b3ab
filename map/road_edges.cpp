#include "pictura/map/road_edges.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "pictura/common/scene.h"

namespace pictura {

namespace {

constexpr double kMaxGap_m = 0.05;               // maximum width of gaps between two bands that count as closed
constexpr double kSharedBorder_m = 0.004;        // maximum distance of borders that count as shared
constexpr double kSampleStep_m = 0.5;            // sampling step along borders
constexpr double kBisectionTolerance_m = 0.002;  // tolerance of the bisection for the ends of an outline
constexpr double kMaxJoinGap_m = 0.06;           // maximum distance of outline ends that are joined
constexpr double kMinOutline_m = 0.3;
constexpr double kSamePoint_m = 1e-3;
constexpr double kOwnReach_m = 1.0;  // neighbouring quads of a band overlap slightly at bends

/// A point on an outline and the band of its border.
struct OutlinePoint {
  Eigen::Vector3d position_m;
  int32_t band = 0;
};

Eigen::Vector3d lerp(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double u) { return a + u * (b - a); }

/// Traverses the four sides of each band clockwise, with the surface on the right, and collects the parts that are on
/// the outline.
class Tracer {
 public:
  Tracer(const std::vector<SurfaceBand>& bands, const Surface& surface) : bands_(bands), surface_(surface) {}

  std::vector<std::vector<OutlinePoint>> trace() {
    for (std::size_t band = 0; band < bands_.size(); ++band) {
      const SurfaceBand& sides = bands_[band];
      band_ = static_cast<int32_t>(band);
      const std::size_t last = sides.left.size() - 1;
      is_narrow_.clear();
      for (std::size_t i = 0; i <= last; ++i) {
        is_narrow_.push_back(plan_distance_m(sides.left[i], sides.right[i]) < kMaxGap_m);
      }
      for (std::size_t i = 0; i < last; ++i) trace_border(sides.left, i, i + 1, sides);
      trace_side(sides.left[last], sides.right[last], is_narrow_[last]);
      for (std::size_t i = last; i > 0; --i) trace_border(sides.right, i, i - 1, sides);
      trace_side(sides.right[0], sides.left[0], is_narrow_[0]);
      finish_run();
    }
    return std::move(runs_);
  }

 private:
  /// Traces the segment of a border between two neighbouring points. In a turn that is tighter than the band's width,
  /// the segment may run backwards. Then the surface is on the left.
  void trace_border(const std::vector<Eigen::Vector3d>& border, std::size_t from, std::size_t to,
                    const SurfaceBand& sides) {
    const std::size_t quad = std::min(from, to);
    const auto across = [&](std::size_t i) -> Eigen::Vector2d { return (sides.left[i] - sides.right[i]).head<2>(); };
    const Eigen::Vector2d left = across(quad) + across(quad + 1);
    const Eigen::Vector2d step = (border[quad + 1] - border[quad]).head<2>();
    const bool is_skipped = is_narrow_[from] && is_narrow_[to];
    quad_ = quad;
    if (left.y() * step.x() - left.x() * step.y() >= 0) return trace_side(border[from], border[to], is_skipped);
    finish_run();
    reach_m_ = 0;
    trace_side(border[to], border[from], is_skipped);
    reach_m_ = kOwnReach_m;
    finish_run();
  }

  /// Traces one straight segment of a band's side.
  void trace_side(const Eigen::Vector3d& a, const Eigen::Vector3d& b, bool is_skipped) {
    const double length_m = plan_distance_m(a, b);
    if (is_skipped) finish_run();
    if (is_skipped || length_m < 1e-9) return;
    const Eigen::Vector2d outward{-(b.y() - a.y()) / length_m, (b.x() - a.x()) / length_m};
    const int steps = std::max(1, static_cast<int>(std::ceil(length_m / kSampleStep_m)));
    // The ends are excluded, because adjacent segments test them.
    const double margin = std::min(0.25, 1e-4 / length_m);
    double previous = margin;
    bool was_edge = is_outline(lerp(a, b, previous), outward, band_);
    if (was_edge) {
      append(a);
    } else {
      finish_run();
    }
    for (int step = 1; step <= steps; ++step) {
      const double here = step == steps ? 1.0 - margin : static_cast<double>(step) / steps;
      const bool is_edge = is_outline(lerp(a, b, here), outward, band_);
      if (is_edge != was_edge) {
        double low = previous, high = here;
        while ((high - low) * length_m > kBisectionTolerance_m) {
          const double middle = 0.5 * (low + high);
          (is_outline(lerp(a, b, middle), outward, band_) == was_edge ? low : high) = middle;
        }
        append(lerp(a, b, is_edge ? high : low));
        if (!is_edge) finish_run();
      }
      previous = here;
      was_edge = is_edge;
    }
    if (was_edge) append(b);
  }

  /// Whether `p`, on the border of `band`, is on the outline. Three conditions must hold: no other band covers the
  /// point just outside `p`, `band` does not fold over this point, and no band of lower index emits the same shared
  /// border. Each of two bands that share a border within kSharedBorder_m may extend slightly beyond the other. So the
  /// test recurses to check that the lower band really emits the border. Exactly one of the bands does.
  bool is_outline(const Eigen::Vector3d& p, const Eigen::Vector2d& outward, int32_t band) {
    surface_.find_near(p.head<2>(), p.z(), &near_);
    for (const double distance_m : {kSharedBorder_m, kMaxGap_m}) {
      if (surface_.is_folded_over(near_, p.head<2>() + distance_m * outward, p.z(), band, quad_, reach_m_))
        return false;
    }
    return is_outline_near(p, outward, band, 0);
  }

  /// Variant of is_outline() for a point that is at most `depth` times kSharedBorder_m from the position of near_.
  bool is_outline_near(const Eigen::Vector3d& p, const Eigen::Vector2d& outward, int32_t band, int depth) const {
    constexpr int kMaxDepth = static_cast<int>((Surface::kNear_m - kMaxGap_m) / kSharedBorder_m) - 1;
    const Surface::Candidates& near = depth <= kMaxDepth ? near_ : none_;
    auto at = [&](double distance_m) -> Eigen::Vector2d { return p.head<2>() + distance_m * outward; };
    auto is_other = [&](int32_t other) { return other != band; };
    if (surface_.any_near(near, at(kSharedBorder_m), p.z(), is_other)) return false;
    if (surface_.any_near(near, at(kMaxGap_m), p.z(), is_other)) return false;
    std::vector<int32_t> adjacent_bands;
    const auto is_lower = [&](int32_t other) {
      return other < band && (adjacent_bands.empty() || adjacent_bands.back() != other);
    };
    surface_.any_near(near, at(-kSharedBorder_m), p.z(), is_lower, [&](int32_t other) {
      adjacent_bands.push_back(other);
      return false;
    });
    for (const int32_t adjacent : adjacent_bands) {
      double inside = -kSharedBorder_m, outside = kSharedBorder_m;
      for (int iteration = 0; iteration < 6; ++iteration) {
        const double middle = 0.5 * (inside + outside);
        const bool covered =
            surface_.any_near(near, at(middle), p.z(), [&](int32_t other) { return other == adjacent; });
        (covered ? inside : outside) = middle;
      }
      const Eigen::Vector2d border = at(inside);
      if (is_outline_near({border.x(), border.y(), p.z()}, outward, adjacent, depth + 1)) return false;
    }
    return true;
  }

  void append(const Eigen::Vector3d& p) {
    if (run_.empty() || plan_distance_m(run_.back().position_m, p) > 1e-6) run_.push_back({p, band_});
  }
  void finish_run() {
    if (run_.size() >= 2) runs_.push_back(std::move(run_));
    run_.clear();
  }

  const std::vector<SurfaceBand>& bands_;
  const Surface& surface_;
  int32_t band_ = 0;
  std::size_t quad_ = 0;             // index, within its band, of the quad beside the current segment
  double reach_m_ = kOwnReach_m;     // distance along the band within which quads do not count as a fold
  std::vector<bool> is_narrow_;      // [points of a side]
  Surface::Candidates near_, none_;  // quads near the current point; an empty set, which causes new lookups
  std::vector<OutlinePoint> run_;
  std::vector<std::vector<OutlinePoint>> runs_;
};

/// Joins runs (connected parts of the outline) that meet end to start, so that pieces can be merged across bands.
class Joiner {
 public:
  explicit Joiner(std::vector<std::vector<OutlinePoint>> runs)
      : runs_(std::move(runs)), is_joined_(runs_.size(), false) {
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      starts_[key(runs_[i].front(), 0, 0)].push_back(i);
      ends_[key(runs_[i].back(), 0, 0)].push_back(i);
    }
  }

  std::vector<std::vector<OutlinePoint>> join() {
    std::vector<std::vector<OutlinePoint>> joined;
    // Joins open outlines first, from their start, then rings.
    for (const bool rings : {false, true}) {
      for (std::size_t i = 0; i < runs_.size(); ++i) {
        if (is_joined_[i] || (!rings && has_predecessor(i))) continue;
        std::vector<OutlinePoint> outline;
        for (std::size_t at = i; at != kNone; at = next_of(outline.back())) {
          is_joined_[at] = true;
          outline.insert(outline.end(), runs_[at].begin(), runs_[at].end());
        }
        joined.push_back(std::move(outline));
      }
    }
    return joined;
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  using Buckets = std::unordered_map<int64_t, std::vector<std::size_t>>;

  static int64_t key(const OutlinePoint& p, int dx, int dy) {
    const int64_t x = static_cast<int64_t>(std::floor(p.position_m.x())) + dx;
    const int64_t y = static_cast<int64_t>(std::floor(p.position_m.y())) + dy;
    return x * 4'000'037 + y;
  }

  template <typename Visit>
  static void visit_near(const Buckets& buckets, const OutlinePoint& p, Visit&& visit) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto bucket = buckets.find(key(p, dx, dy));
        if (bucket == buckets.end()) continue;
        for (const std::size_t item : bucket->second) visit(item);
      }
    }
  }

  static double gap(const OutlinePoint& a, const OutlinePoint& b) {
    const bool is_level = std::abs(a.position_m.z() - b.position_m.z()) < kSameRoadLevel_m;
    return is_level ? plan_distance_m(a.position_m, b.position_m) : 1e300;
  }

  std::size_t next_of(const OutlinePoint& end) const {
    std::size_t best = kNone;
    double best_gap = kMaxJoinGap_m;
    visit_near(starts_, end, [&](std::size_t i) {
      if (is_joined_[i] || gap(end, runs_[i].front()) > best_gap) return;
      best = i;
      best_gap = gap(end, runs_[i].front());
    });
    return best;
  }

  bool has_predecessor(std::size_t i) const {
    bool found = false;
    visit_near(ends_, runs_[i].front(), [&](std::size_t other) {
      found =
          found || (other != i && !is_joined_[other] && gap(runs_[other].back(), runs_[i].front()) <= kMaxJoinGap_m);
    });
    return found;
  }

  std::vector<std::vector<OutlinePoint>> runs_;
  std::vector<bool> is_joined_;
  Buckets starts_, ends_;
};

}  // namespace

std::vector<RoadEdge> outline_of(const std::vector<SurfaceBand>& bands, double chord_error_m,
                                 std::vector<int32_t>* bands_out) {
  std::vector<RoadEdge> edges;
  if (bands.empty()) return edges;
  const Surface surface(bands, kSameRoadLevel_m);
  for (const std::vector<OutlinePoint>& outline : Joiner(Tracer(bands, surface).trace()).join()) {
    std::vector<CurvePoint> points;
    std::vector<int32_t> bands_of_points;
    double length_m = 0;
    for (const OutlinePoint& p : outline) {
      if (!points.empty()) {
        const double step_m = plan_distance_m(points.back().position_m, p.position_m);
        if (step_m < kSamePoint_m) continue;
        // Cuts long segments, such as the end of a wide road.
        const Eigen::Vector3d begin = points.back().position_m;
        const int pieces = std::max(1, static_cast<int>(std::ceil(step_m / kMaxPiece_m - kPieceRounding)));
        for (int i = 1; i < pieces; ++i) {
          const double u = static_cast<double>(i) / pieces;
          points.push_back({length_m + u * step_m, lerp(begin, p.position_m, u), 0});
          bands_of_points.push_back(p.band);
        }
        length_m += step_m;
      }
      points.push_back({length_m, p.position_m, 0});
      bands_of_points.push_back(p.band);
    }
    if (length_m < kMinOutline_m) continue;
    const std::vector<std::size_t> indices = thin_polyline(points, chord_error_m, kMaxPiece_m);
    for (std::size_t i = 1; i < indices.size(); ++i) {
      const Eigen::Vector3d &a = points[indices[i - 1]].position_m, &b = points[indices[i]].position_m;
      if (plan_distance_m(a, b) < kSamePoint_m) continue;  // the outline returns to the same point
      edges.push_back({to_vec3(a), to_vec3(b)});
      if (bands_out) bands_out->push_back(bands_of_points[indices[i - 1]]);
    }
  }
  return edges;
}

}  // namespace pictura
