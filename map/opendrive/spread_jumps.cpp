#include "pictura/map/opendrive/spread_jumps.h"

#include <algorithm>
#include <cmath>

#include "pictura/map/opendrive/curves.h"

namespace pictura::opendrive {

namespace {

constexpr double kMinSpan_m = 10, kSpanPerJump = 10;
// Minimum ratio of the span to the jump. With this ratio, the line turns by at most 0.2 rad, because a smoothstep is
// 1.5 times as steep as its chord.
constexpr double kMinSpanPerJump = 7.5;
// Maximum length of the cubics that replace a moved line. It keeps their error below 0.1 mm.
constexpr double kMaxCubic_m = 1;

/// Range of s over which a jump is spread.
struct Stretch {
  double begin = 0, end = 0;
};

Stretch stretch_of(double s, double jump_m, double road_length) {
  const double span = std::min(road_length, std::max(kMinSpan_m, kSpanPerJump * std::abs(jump_m)));
  const double begin = std::clamp(s - 0.5 * span, 0.0, road_length - span);
  return {begin, begin + span};
}

struct Spread : Stretch {
  Jump jump;
};

/// A point of the moved line, and its derivative with respect to s.
struct Knot {
  Eigen::Vector2d position_m, slope;
};

/// Returns the cubic between two knots that are `length` apart in s.
GeometryPiece cubic_between(const Knot& a, const Knot& b, double s, double length) {
  GeometryPiece piece;
  piece.s = s;
  piece.x = a.position_m.x();
  piece.y = a.position_m.y();
  piece.heading = std::atan2(a.slope.y(), a.slope.x());
  piece.length = length;
  const Eigen::Vector2d along{std::cos(piece.heading), std::sin(piece.heading)}, left{-along.y(), along.x()};
  const Eigen::Vector2d chord = b.position_m - a.position_m;
  const auto coefficients = [&](const Eigen::Vector2d& axis) -> std::array<double, 4> {
    const double first = length * axis.dot(a.slope), last = length * axis.dot(b.slope), way = axis.dot(chord);
    return {0, first, 3 * way - 2 * first - last, first + last - 2 * way};
  };
  piece.cubic = PlaneCubic{.u = coefficients(along), .v = coefficients(left), .p_end = 1};
  measure(&*piece.cubic);
  return piece;
}

class JumpSpreader {
 public:
  JumpSpreader(const std::vector<Jump>& jumps, FileRoad* road) : road_(*road) {
    for (const Jump& jump : jumps) {
      spreads_.push_back({stretch_of(road_.geometry[jump.piece].s, jump.shift_m.norm(), road_.length), jump});
    }
  }

  void run() {
    for (std::size_t i = 0; i < road_.geometry.size(); ++i) replace(i);
    road_.geometry = std::move(moved_);
  }

 private:
  /// Appends the geometry if no jump is spread over it, else cubics that replace it.
  void replace(std::size_t index) {
    const GeometryPiece& piece = road_.geometry[index];
    const double piece_end = piece.s + piece.length;
    active_.clear();
    std::vector<double> stations{piece.s, piece_end};
    for (const Spread& spread : spreads_) {
      if (spread.begin >= piece_end || spread.end <= piece.s) continue;
      active_.push_back(&spread);
      for (const double s : {spread.begin, spread.end}) {
        if (s > piece.s && s < piece_end) stations.push_back(s);
      }
    }
    if (active_.empty()) return moved_.push_back(piece);
    std::sort(stations.begin(), stations.end());
    for (std::size_t i = 1; i < stations.size(); ++i) {
      const double begin = stations[i - 1], length = stations[i] - begin;
      if (length <= 0) continue;
      const int count = static_cast<int>(std::ceil(length / kMaxCubic_m));
      Knot knot = knot_at(index, begin);
      for (int step = 1; step <= count; ++step) {
        const Knot next = knot_at(index, begin + length * step / count);
        moved_.push_back(cubic_between(knot, next, begin + length * (step - 1) / count, length / count));
        knot = next;
      }
    }
  }

  Knot knot_at(std::size_t index, double s) const {
    const GeometryPiece& piece = road_.geometry[index];
    const Pose pose = pose_on(piece, std::clamp(s - piece.s, 0.0, piece.length));
    const double speed = piece.cubic ? piece.cubic->arc_length.back() / piece.length : 1;
    Knot knot{pose.position_m, speed * Eigen::Vector2d{std::cos(pose.heading), std::sin(pose.heading)}};
    for (const Spread* spread : active_) {
      const double span = spread->end - spread->begin;
      const double x = std::clamp((s - spread->begin) / span, 0.0, 1.0);
      const double share = x * x * (3 - 2 * x) - (index >= spread->jump.piece ? 1 : 0);
      knot.position_m += share * spread->jump.shift_m;
      knot.slope += 6 * x * (1 - x) / span * spread->jump.shift_m;
    }
    return knot;
  }

  FileRoad& road_;
  std::vector<Spread> spreads_;
  std::vector<const Spread*> active_;  // jumps that are spread over the current geometry
  std::vector<GeometryPiece> moved_;
};

/// Returns the continuation of `cubic` from station s.
Cubic continued(const Cubic& cubic, double s) {
  const double ds = s - cubic.s;
  return {.s = s,
          .a = cubic.a + ds * (cubic.b + ds * (cubic.c + ds * cubic.d)),
          .b = cubic.b + ds * (2 * cubic.c + 3 * ds * cubic.d),
          .c = cubic.c + 3 * ds * cubic.d,
          .d = cubic.d};
}

/// Returns the smoothstep from 0 to `rise` over the stretch.
Cubic smoothstep(const Stretch& stretch, double rise) {
  const double span = stretch.end - stretch.begin;
  return {.s = stretch.begin, .c = 3 * rise / (span * span), .d = -2 * rise / (span * span * span)};
}

}  // namespace

bool can_spread_jump(double jump_m, double road_length_m) { return road_length_m >= kMinSpanPerJump * jump_m; }

void spread_jumps(const std::vector<Jump>& jumps, FileRoad* road) { JumpSpreader(jumps, road).run(); }

void spread_height_jumps(const std::vector<HeightJump>& jumps, FileRoad* road) {
  std::vector<Stretch> stretches;
  std::vector<double> stations;
  for (const Cubic& cubic : road->elevation.cubics) stations.push_back(cubic.s);
  for (const HeightJump& jump : jumps) {
    stretches.push_back(stretch_of(jump.s, jump.rise_m, road->length));
    stations.insert(stations.end(), {stretches.back().begin, stretches.back().end});
  }
  std::sort(stations.begin(), stations.end());
  stations.erase(std::unique(stations.begin(), stations.end()), stations.end());
  Profile spread;
  auto next = road->elevation.cubics.cbegin();
  Cubic base;
  for (const double s : stations) {
    while (next != road->elevation.cubics.cend() && next->s <= s) base = *next++;
    Cubic cubic = continued(base, s);
    for (std::size_t i = 0; i < jumps.size(); ++i) {
      if (s < stretches[i].begin || s >= stretches[i].end) continue;
      const Cubic step = continued(smoothstep(stretches[i], jumps[i].rise_m), s);
      cubic.a += step.a - (s >= jumps[i].s ? jumps[i].rise_m : 0);
      cubic.b += step.b;
      cubic.c += step.c;
      cubic.d += step.d;
    }
    spread.cubics.push_back(cubic);
  }
  road->elevation = std::move(spread);
}

}  // namespace pictura::opendrive
