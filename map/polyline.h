// Curves to polylines: sampled until no chord strays from the curve by more than a tolerance, with as few points as
// that allows and pieces of bounded length. Shared by everything that the importers draw or drive on.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "pictura/common/error.h"

namespace pictura {

/// Rounding may make pieces longer than asked for by this much.
constexpr double kPieceSlack = 1e-6;

/// A place in a file's or a map's coordinates, before it is rounded to float.
struct Point3 {
  double x = 0, y = 0, z = 0;
};

/// A sample of a curve: its parameter, its place, and a width (0 for a bare line) that chords must follow too.
struct CurvePoint {
  double s = 0, x = 0, y = 0, z = 0, width = 0;
};

/// How far `p` lies from the chord a-b: its distance in space, or half the error in width where that is more.
double chord_error(const CurvePoint& a, const CurvePoint& b, const CurvePoint& p);

/// The indices of the points to keep, first and last included, so that every point left out is within `tolerance_m` of
/// the chord that passes it and no chord is longer (in plan) than `max_piece_m`, unless two neighbours are.
std::vector<std::size_t> thin_polyline(const std::vector<CurvePoint>& points, double tolerance_m, double max_piece_m);

/// Counts samples, so that no input, however long or wound, makes a map larger than memory.
class SampleBudget {
 public:
  explicit SampleBudget(std::int64_t samples) : left_(samples) {}
  void spend() {
    if (--left_ < 0) fail("the map's curves need more samples than a map may have");
  }

 private:
  std::int64_t left_;
};

/// Samples eval(s) -> CurvePoint over [breaks.front(), breaks.back()], whose inner breaks separate smooth stretches.
template <typename Eval>
std::vector<CurvePoint> sample_curve(const std::vector<double>& breaks, double tolerance_m, double max_piece_m,
                                     SampleBudget* budget, Eval&& eval) {
  constexpr int kMaxDepth = 24;
  constexpr double kMinStep = 0.01;
  constexpr double kStepsPerPiece = 4;
  constexpr double kDenseShare = 0.1;  // of the tolerance: spent on sampling; the rest on thinning
  std::vector<CurvePoint> dense{eval(breaks.front())};
  auto refine = [&](auto&& self, const CurvePoint& a, const CurvePoint& b, int depth) -> void {
    budget->spend();
    if (depth < kMaxDepth) {
      bool fine = std::hypot(b.x - a.x, b.y - a.y) <= max_piece_m + kPieceSlack;
      CurvePoint middle = eval(0.5 * (a.s + b.s));
      fine = fine && chord_error(a, b, middle) <= kDenseShare * tolerance_m;
      for (const double fraction : {0.25, 0.75}) {
        fine = fine && chord_error(a, b, eval(a.s + fraction * (b.s - a.s))) <= kDenseShare * tolerance_m;
      }
      if (!fine && b.s - a.s > kMinStep) {
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
    // Even steps, several to a piece, so that thinning can come close to the longest piece that is allowed.
    const int steps = static_cast<int>(std::ceil(kStepsPerPiece * span / max_piece_m - kPieceSlack));
    for (int step = 1; step <= steps; ++step) {
      refine(refine, CurvePoint(dense.back()), eval(step == steps ? breaks[i] : begin + span * step / steps), 0);
    }
  }
  std::vector<CurvePoint> kept;
  for (const std::size_t index : thin_polyline(dense, (1 - kDenseShare) * tolerance_m, max_piece_m))
    kept.push_back(dense[index]);
  return kept;
}

}  // namespace pictura
