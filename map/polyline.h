// Conversion of curves to polylines, shared by all importers. The polylines have few points, their pieces have bounded
// length, and they deviate from the curve by at most a tolerance.
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

/// A sample of a curve: its parameter, its position, and a width (0 for a line without width). Polylines approximate
/// the width too. Positions are in file or map coordinates, before rounding to float.
struct CurvePoint {
  double s = 0;
  Eigen::Vector3d position_m{0, 0, 0};
  double width = 0;
};

/// Distance in plan: on the ground plane, without height.
inline double plan_distance_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return hypot_of(b.x() - a.x(), b.y() - a.y());
}

/// Whether the distance in plan is at most `limit_m`.
inline bool is_within(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double limit_m) {
  const double dx = b.x() - a.x(), dy = b.y() - a.y();
  return dx * dx + dy * dy <= limit_m * limit_m;
}

inline Vec3 to_vec3(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// Deviation of `p` from the chord a-b: its distance in space, or half the error in width if that is larger.
inline double chord_error(const CurvePoint& a, const CurvePoint& b, const CurvePoint& p) {
  // Adds the height's term last, because another order would change the bits of imported maps.
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

/// Returns the indices of a subset of the points, first and last included. Every omitted point is within `tolerance_m`
/// of the chord that replaces it. No chord is longer (in plan) than `max_piece_m`, unless two neighbouring points are
/// farther apart.
std::vector<std::size_t> thin_polyline(const std::vector<CurvePoint>& points, double tolerance_m, double max_piece_m);

/// Limit on the number of samples, so that no input can exhaust memory. count_sample() throws Error beyond the limit,
/// and Interrupted if `work` is interrupted.
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

/// Parameters at which a curve is cut for sampling, because its formula changes there. The curve is smooth between
/// breaks. At a break, either formula may determine the curve's value.
struct CurveBreaks {
  std::vector<double> s;
  // Upper bounds of the second derivatives, with respect to s, of the position and of half the width. There is one
  // bound for each interval between two breaks, infinite if unknown. An empty vector means that all are unknown.
  std::vector<double> bend;
};

/// Samples eval(s) -> CurvePoint over all intervals between breaks.
template <typename Eval>
std::vector<CurvePoint> sample_curve(const CurveBreaks& curve, double tolerance_m, double max_piece_m,
                                     SampleBudget* budget, Eval&& eval) {
  constexpr int kMaxDepth = 24;
  constexpr double kMinStep = 0.01;
  constexpr double kStepsPerPiece = 4;
  constexpr double kDenseShare = 0.1;  // share of the tolerance for sampling; the rest is for thinning
  constexpr double kSafety = 0.9;      // margin far above rounding errors
  const std::vector<double>& breaks = curve.s;
  std::vector<CurvePoint> dense{eval(breaks.front())};
  double low = 0, high = 0, bend = 0;  // range of s and bound of the second derivative in the current interval
  auto refine = [&](auto&& self, const CurvePoint& a, const CurvePoint& b, int depth) -> void {
    budget->count_sample();
    if (depth < kMaxDepth) {
      bool is_fine = is_within(a.position_m, b.position_m, max_piece_m + kPieceRounding);
      // A chord over an interval h of s deviates by at most h^2 / 8 times the second derivative, so most chords need no
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
    // Uses even steps, several per piece, so that, after thinning, pieces can be nearly as long as allowed.
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
