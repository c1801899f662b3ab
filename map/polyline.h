// Conversion of curves to polylines with few points and bounded deviation.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pictura/common/error.h"
#include "pictura/common/hypot.h"
#include "pictura/common/math.h"
#include "pictura/common/support/interrupt.h"

namespace pictura {

/// Length in metres by which rounding may make pieces longer than the maximum.
constexpr double kPieceRounding = 1e-6;

/// A sample of a curve, in file or map coordinates. `width` is 0 for lines.
struct CurvePoint {
  double s = 0;
  Eigen::Vector3d position_m{0, 0, 0};
  double width = 0;
};

/// Distance on the ground plane, without height ("in plan").
inline double plan_distance_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return hypot_of(b.x() - a.x(), b.y() - a.y());
}

inline bool is_within(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double limit_m) {
  const double dx = b.x() - a.x(), dy = b.y() - a.y();
  return dx * dx + dy * dy <= limit_m * limit_m;
}

inline Vec3 to_vec3(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// Deviation of `p` from the chord a-b: the distance in space, or half the error in width if larger.
inline double chord_error(const CurvePoint& a, const CurvePoint& b, const CurvePoint& p) {
  // Another order of the sum would change the bits of imported maps.
  const auto dot = [](const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
    return v.head<2>().dot(w.head<2>()) + v.z() * w.z();
  };
  const Eigen::Vector3d chord = b.position_m - a.position_m;
  const double length2 = dot(chord, chord);
  double u = 0;
  if (length2 > 0) u = std::clamp(dot(p.position_m - a.position_m, chord) / length2, 0.0, 1.0);
  const Eigen::Vector3d error = p.position_m - (a.position_m + u * chord);
  return std::max(std::sqrt(dot(error, error)), 0.5 * std::abs(p.width - (a.width + u * (b.width - a.width))));
}

/// Returns the indices of the points to keep, including both ends. Omitted points are within `tolerance_m` of their
/// chord. Only chords between neighbouring points may be longer than `max_piece_m` in plan.
std::vector<std::size_t> thin_polyline(const std::vector<CurvePoint>& points, double tolerance_m, double max_piece_m);

/// Limit on the number of samples. count_sample() throws Error beyond the limit, and Interrupted if `work` is
/// interrupted.
class SampleBudget {
 public:
  /// `source` is the map's name in messages.
  SampleBudget(std::int64_t max_samples, std::string source, InterruptibleWork work)
      : max_samples_(max_samples), remaining_(max_samples), source_(std::move(source)), work_(std::move(work)) {}
  const InterruptibleWork& work() const { return work_; }
  void count_sample() {
    constexpr std::int64_t kSamplesPerCheck = 1024;
    if (remaining_ % kSamplesPerCheck == 0) work_.check();
    if (--remaining_ < 0) {
      fail("{}: its curves need more than {} samples, the limit for a file of its size", source_, max_samples_);
    }
  }

 private:
  std::int64_t max_samples_, remaining_;
  std::string source_;
  InterruptibleWork work_;
};

/// Parameters between which a curve is smooth. At a break, the curve's value may come from either adjacent formula.
struct CurveBreaks {
  std::vector<double> s;
  // [intervals] Upper bounds of the second derivatives of position and of half the width, with respect to s. Infinite
  // if unknown; empty if all are unknown.
  std::vector<double> bend;
};

/// Samples eval(s) -> CurvePoint between the first and the last break, and thins the samples.
template <typename Eval>
std::vector<CurvePoint> sample_curve(const CurveBreaks& curve, double tolerance_m, double max_piece_m,
                                     SampleBudget* budget, Eval&& eval) {
  constexpr int kMaxDepth = 24;
  constexpr double kMinStep = 0.01;
  constexpr double kStepsPerPiece = 4;
  constexpr double kDenseShare = 0.1;  // share of the tolerance for sampling; the rest is for thinning
  constexpr double kSafety = 0.9;      // the margin of 0.1 is far above rounding errors
  const std::vector<double>& breaks = curve.s;
  std::vector<CurvePoint> dense{eval(breaks.front())};
  double low = 0, high = 0, bend = 0;
  auto refine = [&](auto&& self, const CurvePoint& a, const CurvePoint& b, int depth) -> void {
    budget->count_sample();
    if (depth < kMaxDepth) {
      bool is_fine = is_within(a.position_m, b.position_m, max_piece_m + kPieceRounding);
      // A chord over an interval h deviates by at most h^2 / 8 times the second derivative, so most chords need no
      // test.
      const double h = b.s - a.s;
      if (is_fine && a.s > low && b.s < high && bend * h * h <= 8 * kSafety * kDenseShare * tolerance_m) {
        dense.push_back(b);
        return;
      }
      CurvePoint middle = eval(0.5 * (a.s + b.s));
      is_fine = is_fine && chord_error(a, b, middle) <= kDenseShare * tolerance_m;
      for (const double fraction : {0.25, 0.75}) {
        is_fine = is_fine && chord_error(a, b, eval(a.s + fraction * (b.s - a.s))) <= kDenseShare * tolerance_m;
      }
      if (!is_fine && b.s - a.s > kMinStep) {
        self(self, a, middle, depth + 1);
        self(self, middle, b, depth + 1);
        return;
      }
    }
    dense.push_back(b);
  };
  for (std::size_t i = 1; i < breaks.size(); ++i) {
    const double begin = dense.back().s, span = breaks[i] - begin;
    if (span <= 0) continue;
    // Steps are at most a quarter of the maximum length, so that thinned pieces can be nearly as long as the maximum.
    const int steps = static_cast<int>(std::ceil(kStepsPerPiece * span / max_piece_m - kPieceRounding));
    low = begin;
    high = breaks[i];
    bend = curve.bend.empty() ? std::numeric_limits<double>::infinity() : curve.bend[i - 1];
    for (int step = 1; step <= steps; ++step) {
      refine(refine, CurvePoint(dense.back()), eval(step == steps ? breaks[i] : begin + span * step / steps), 0);
    }
  }
  std::vector<CurvePoint> thinned;
  for (const std::size_t index : thin_polyline(dense, (1 - kDenseShare) * tolerance_m, max_piece_m))
    thinned.push_back(dense[index]);
  return thinned;
}

}  // namespace pictura
