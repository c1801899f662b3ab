#include "pictura/map/road_edges.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "pictura/common/scene.h"

namespace pictura {

namespace {

constexpr double kLevel_m = 2.0;
constexpr double kCrack_m = 0.05;        // a gap this wide between two bands is a crack and no edge
constexpr double kCoincident_m = 0.004;  // borders nearer than this are one border
constexpr double kStep_m = 0.5;          // borders are tested at least this often
constexpr double kTransition_m = 0.002;  // where an outline begins and ends is found to this
constexpr double kJoin_m = 0.06;         // ends of outlines nearer than this are joined
constexpr double kMinOutline_m = 0.3;

/// A place on an outline and the band whose border it is.
struct OutlinePoint : Point3 {
  int32_t band = 0;
};

Point3 lerp(const Point3& a, const Point3& b, double u) {
  return {a.x + u * (b.x - a.x), a.y + u * (b.y - a.y), a.z + u * (b.z - a.z)};
}

double plan_distance(const Point3& a, const Point3& b) { return std::hypot(b.x - a.x, b.y - a.y); }

/// Walks the four sides of each band clockwise, surface to the right, and keeps what lies on the outline.
class Tracer {
 public:
  Tracer(const std::vector<SurfaceBand>& bands, const Surface& surface) : bands_(bands), surface_(surface) {}

  std::vector<std::vector<OutlinePoint>> trace() {
    for (std::size_t band = 0; band < bands_.size(); ++band) {
      const SurfaceBand& sides = bands_[band];
      band_ = static_cast<int32_t>(band);
      auto is_narrow = [&](std::size_t i) { return plan_distance(sides.left[i], sides.right[i]) < kCrack_m; };
      const std::size_t last = sides.left.size() - 1;
      for (std::size_t i = 0; i < last; ++i) {
        side(sides.left[i], sides.left[i + 1], is_narrow(i) && is_narrow(i + 1));
      }
      side(sides.left[last], sides.right[last], is_narrow(last));
      for (std::size_t i = last; i > 0; --i) {
        side(sides.right[i], sides.right[i - 1], is_narrow(i) && is_narrow(i - 1));
      }
      side(sides.right[0], sides.left[0], is_narrow(0));
      finish_run();
    }
    return std::move(runs_);
  }

 private:
  /// One straight piece of the walk.
  void side(const Point3& a, const Point3& b, bool skipped) {
    const double length_m = plan_distance(a, b);
    if (skipped) finish_run();
    if (skipped || length_m < 1e-9) return;
    const Point2 outward{-(b.y - a.y) / length_m, (b.x - a.x) / length_m};
    const int steps = std::max(1, static_cast<int>(std::ceil(length_m / kStep_m)));
    // Just inside the ends, where the neighbouring piece has the say.
    const double margin = std::min(0.25, 1e-4 / length_m);
    double before = margin;
    bool kept_before = is_outline(lerp(a, b, before), outward, band_);
    if (kept_before) {
      append(a);
    } else {
      finish_run();
    }
    for (int step = 1; step <= steps; ++step) {
      const double here = step == steps ? 1.0 - margin : static_cast<double>(step) / steps;
      const bool kept = is_outline(lerp(a, b, here), outward, band_);
      if (kept != kept_before) {
        double low = before, high = here;
        while ((high - low) * length_m > kTransition_m) {
          const double middle = 0.5 * (low + high);
          (is_outline(lerp(a, b, middle), outward, band_) == kept_before ? low : high) = middle;
        }
        append(lerp(a, b, kept ? high : low));
        if (!kept) finish_run();
      }
      before = here;
      kept_before = kept;
    }
    if (kept_before) append(b);
  }

  /// Whether no other band covers the place just outside `p` on the border of `band`, and no band of a lower index is
  /// to draw a border that both share. Bands that share a border within kCoincident_m may each lie a little further out
  /// than another, so the question goes down to whether the lower one really draws it: one of them always does.
  bool is_outline(const Point3& p, const Point2& outward, int32_t band) const {
    auto at = [&](double distance) { return Point2{p.x + distance * outward.x, p.y + distance * outward.y}; };
    auto is_other = [&](int32_t other) { return other != band; };
    if (surface_.any_band_at(at(kCoincident_m), p.z, is_other)) return false;
    if (surface_.any_band_at(at(kCrack_m), p.z, is_other)) return false;
    std::vector<int32_t> sharers;
    surface_.any_band_at(at(-kCoincident_m), p.z, [&](int32_t other) {
      if (other < band && (sharers.empty() || sharers.back() != other)) sharers.push_back(other);
      return false;
    });
    for (const int32_t sharer : sharers) {
      double inside = -kCoincident_m, outside = kCoincident_m;
      for (int halving = 0; halving < 6; ++halving) {
        const double middle = 0.5 * (inside + outside);
        const bool covered = surface_.any_band_at(at(middle), p.z, [&](int32_t other) { return other == sharer; });
        (covered ? inside : outside) = middle;
      }
      const Point2 border = at(inside);
      if (is_outline({border.x, border.y, p.z}, outward, sharer)) return false;
    }
    return true;
  }

  void append(const Point3& p) {
    if (run_.empty() || plan_distance(run_.back(), p) > 1e-6) run_.push_back({p, band_});
  }
  void finish_run() {
    if (run_.size() >= 2) runs_.push_back(std::move(run_));
    run_.clear();
  }

  const std::vector<SurfaceBand>& bands_;
  const Surface& surface_;
  int32_t band_ = 0;
  std::vector<OutlinePoint> run_;
  std::vector<std::vector<OutlinePoint>> runs_;
};

/// Joins runs whose end lies at another's beginning, so that pieces may be merged across bands.
class Joiner {
 public:
  explicit Joiner(std::vector<std::vector<OutlinePoint>> runs) : runs_(std::move(runs)), used_(runs_.size(), false) {
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      starts_[key(runs_[i].front(), 0, 0)].push_back(i);
      ends_[key(runs_[i].back(), 0, 0)].push_back(i);
    }
  }

  std::vector<std::vector<OutlinePoint>> join() {
    std::vector<std::vector<OutlinePoint>> joined;
    // Open outlines from their beginnings first, then what is left: rings.
    for (const bool rings : {false, true}) {
      for (std::size_t i = 0; i < runs_.size(); ++i) {
        if (used_[i] || (!rings && has_predecessor(i))) continue;
        std::vector<OutlinePoint> outline;
        for (std::size_t at = i; at != kNone; at = next_of(outline.back())) {
          used_[at] = true;
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

  static int64_t key(const Point3& p, int dx, int dy) {
    const int64_t x = static_cast<int64_t>(std::floor(p.x)) + dx, y = static_cast<int64_t>(std::floor(p.y)) + dy;
    return x * 4'000'037 + y;
  }

  template <typename Visit>
  static void near(const Buckets& buckets, const Point3& p, Visit&& visit) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto bucket = buckets.find(key(p, dx, dy));
        if (bucket == buckets.end()) continue;
        for (const std::size_t item : bucket->second) visit(item);
      }
    }
  }

  static double gap(const Point3& a, const Point3& b) {
    return std::abs(a.z - b.z) < kLevel_m ? plan_distance(a, b) : 1e300;
  }

  std::size_t next_of(const Point3& end) const {
    std::size_t best = kNone;
    double best_gap = kJoin_m;
    near(starts_, end, [&](std::size_t i) {
      if (used_[i] || gap(end, runs_[i].front()) > best_gap) return;
      best = i;
      best_gap = gap(end, runs_[i].front());
    });
    return best;
  }

  bool has_predecessor(std::size_t i) const {
    bool found = false;
    near(ends_, runs_[i].front(), [&](std::size_t other) {
      found = found || (other != i && !used_[other] && gap(runs_[other].back(), runs_[i].front()) <= kJoin_m);
    });
    return found;
  }

  std::vector<std::vector<OutlinePoint>> runs_;
  std::vector<bool> used_;
  Buckets starts_, ends_;
};

}  // namespace

std::vector<RoadEdge> outline_of(const std::vector<SurfaceBand>& bands, double chord_error_m,
                                 std::vector<int32_t>* bands_out) {
  std::vector<RoadEdge> edges;
  if (bands.empty()) return edges;
  const Surface surface(bands, kLevel_m);
  for (const std::vector<OutlinePoint>& outline : Joiner(Tracer(bands, surface).trace()).join()) {
    std::vector<CurvePoint> points;
    std::vector<int32_t> bands_of_points;
    double length_m = 0;
    for (const OutlinePoint& p : outline) {
      if (!points.empty()) {
        const double step_m = std::hypot(p.x - points.back().x, p.y - points.back().y);
        if (step_m < 1e-3) continue;
        length_m += step_m;
      }
      points.push_back({length_m, p.x, p.y, p.z, 0});
      bands_of_points.push_back(p.band);
    }
    if (length_m < kMinOutline_m) continue;
    const std::vector<std::size_t> kept = thin_polyline(points, chord_error_m, kMaxPiece_m);
    auto to_vec3 = [](const CurvePoint& p) {
      return Vec3{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    };
    for (std::size_t i = 1; i < kept.size(); ++i) {
      edges.push_back({to_vec3(points[kept[i - 1]]), to_vec3(points[kept[i]])});
      if (bands_out) bands_out->push_back(bands_of_points[kept[i - 1]]);
    }
  }
  return edges;
}

}  // namespace pictura
