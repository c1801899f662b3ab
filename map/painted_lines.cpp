#include "pictura/map/painted_lines.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "pictura/common/grid.h"
#include "pictura/common/scene.h"
#include "pictura/map/polyline.h"

namespace pictura {

namespace {

// Maximum distance of points that count as coincident, at ends that meet and in duplicate paint. In CARLA's towns, of
// the line ends that continue within 1 cm, 99 % continue within 1 mm.
constexpr float kCoincident_m = 1e-3f;
// Tolerance of thinning. A duplicate may deviate by kCoincident_m sideways and by kCoincident_m beyond the ends.
// Joining may move points by kCoincident_m. Thinning uses the rest of kPaintTolerance_m.
constexpr float kThinningTolerance_m = kPaintTolerance_m - 3 * kCoincident_m;
constexpr float kMaxBend = 0.25f;                // sine of the angle between lines that continue each other
constexpr float kMaxChord_m = 10 * kMaxPiece_m;  // bounds the time of thinning; drawing cuts chords into pieces
constexpr float kPieceCell_m = 20.0f;

bool have_equal_style(const PaintedLine& a, const PaintedLine& b) {
  return a.width_m == b.width_m && a.color == b.color;
}

Aabb2 box_around(Vec2 a, Vec2 b, float margin_m) {
  return {{min_of(a.x, b.x) - margin_m, min_of(a.y, b.y) - margin_m},
          {max_of(a.x, b.x) + margin_m, max_of(a.y, b.y) + margin_m}};
}

std::vector<PaintedLine> lines_of_markings(const RoadMap& map) {
  std::vector<PaintedLine> lines;
  for (const Marking& marking : map.markings) {
    PaintedLine line{.width_m = marking.width_m, .color = marking.color};
    for (int32_t i = marking.points.begin; i < marking.points.end; ++i) {
      const Vec3 point = map.marking_points[i];
      if (line.points_m.empty() || length((point - line.points_m.back()).xy()) >= kRepeatedPoint_m) {
        line.points_m.push_back(point);
      }
    }
    if (line.points_m.size() >= 2) lines.push_back(std::move(line));
  }
  return lines;
}

/// Line segments in a grid, for tests of whether they cover a given segment.
class PieceIndex {
 public:
  struct Piece {
    Vec3 a_m, b_m;
    std::size_t line = 0;
  };
  explicit PieceIndex(const std::vector<PaintedLine>& lines) {
    std::vector<Aabb2> boxes;
    for (std::size_t line = 0; line < lines.size(); ++line) {
      const std::vector<Vec3>& points = lines[line].points_m;
      for (std::size_t i = 1; i < points.size(); ++i) {
        pieces_.push_back({points[i - 1], points[i], line});
        boxes.push_back(box_around(points[i - 1].xy(), points[i].xy(), kCoincident_m));
      }
    }
    grid_ = Grid(boxes, kPieceCell_m);
  }

  const std::vector<Piece>& pieces() const { return pieces_; }

  /// Whether lines cover the whole straight segment from a to b, each line within tolerance_m(line). Lines with
  /// negative tolerance are ignored. max_m is the largest tolerance, and gaps up to max_m are ignored.
  template <typename Tolerance>
  bool is_covered(Vec3 a_m, Vec3 b_m, float max_m, const Tolerance& tolerance_m) const {
    const float length_m = length(b_m - a_m);
    const Segment segment{a_m, (b_m - a_m) * (1.0f / length_m), length_m};
    std::vector<Interval> intervals;
    visit_items(grid_.view(), box_around(a_m.xy(), b_m.xy(), max_m), [&](std::size_t i) {
      const float line_tolerance_m = tolerance_m(pieces_[i].line);
      if (line_tolerance_m < 0) return;
      const Interval covered = covered_interval(segment, pieces_[i], line_tolerance_m);
      if (covered.end_m > covered.begin_m) intervals.push_back(covered);
    });
    std::sort(intervals.begin(), intervals.end(), [](Interval a, Interval b) { return a.begin_m < b.begin_m; });
    float covered_to_m = 0;
    for (const Interval& interval : intervals) {
      if (interval.begin_m > covered_to_m + max_m) return false;
      covered_to_m = max_of(covered_to_m, interval.end_m);
    }
    return !intervals.empty() && covered_to_m >= length_m - max_m;
  }

 private:
  struct Segment {
    Vec3 begin_m, along;  // along is a unit vector
    float length_m = 0;
  };
  /// A part of a segment, in metres from its start.
  struct Interval {
    float begin_m = 0, end_m = 0;
  };

  /// Returns the part of a segment that is alongside a piece. Returns an empty interval if the piece is farther away
  /// than the tolerance at either end of that part.
  static Interval covered_interval(const Segment& segment, const Piece& piece, float tolerance_m) {
    const float a_m = dot(piece.a_m - segment.begin_m, segment.along),
                b_m = dot(piece.b_m - segment.begin_m, segment.along);
    const Interval overlap{max_of(min_of(a_m, b_m), 0.0f), min_of(max_of(a_m, b_m), segment.length_m)};
    if (overlap.end_m <= overlap.begin_m) return {};
    for (const float at_m : {overlap.begin_m, overlap.end_m}) {
      const Vec3 position_m = piece.a_m + (piece.b_m - piece.a_m) * ((at_m - a_m) / (b_m - a_m));
      if (length(position_m - (segment.begin_m + segment.along * at_m)) > tolerance_m) return {};
    }
    return overlap;
  }

  std::vector<Piece> pieces_;
  Grid grid_;
};

/// Removes lines that other lines cover along their whole length. Overlapping roads of a junction contain such lines:
/// the same paint, cut at different places. Longer lines are processed first, and only lines that are kept cover
/// others.
class DuplicateLines {
 public:
  explicit DuplicateLines(std::vector<PaintedLine> lines)
      : lines_(std::move(lines)), is_kept_(lines_.size(), false), pieces_(lines_) {}

  std::vector<PaintedLine> remove() {
    std::vector<float> lengths_m(lines_.size(), 0.0f);
    for (const PieceIndex::Piece& piece : pieces_.pieces()) lengths_m[piece.line] += length(piece.b_m - piece.a_m);
    std::vector<std::size_t> order(lines_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return lengths_m[a] > lengths_m[b]; });
    for (const std::size_t line : order) {
      const std::vector<Vec3>& points = lines_[line].points_m;
      for (std::size_t i = 1; i < points.size() && !is_kept_[line]; ++i) {
        is_kept_[line] = !is_covered_by_kept(line, points[i - 1], points[i]);
      }
    }
    std::vector<PaintedLine> unique_lines;
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      if (is_kept_[line]) unique_lines.push_back(std::move(lines_[line]));
    }
    return unique_lines;
  }

 private:
  /// Whether kept lines of the same style cover a piece of `line`.
  bool is_covered_by_kept(std::size_t line, Vec3 a_m, Vec3 b_m) const {
    return pieces_.is_covered(a_m, b_m, kCoincident_m, [&](std::size_t other) {
      return is_kept_[other] && have_equal_style(lines_[other], lines_[line]) ? kCoincident_m : -1.0f;
    });
  }

  std::vector<PaintedLine> lines_;
  std::vector<bool> is_kept_;
  PieceIndex pieces_;
};

/// Joins lines end to end, in any orientation. End 2 * i is the first point of line i, end 2 * i + 1 its last.
class LineJoiner {
 public:
  explicit LineJoiner(std::vector<PaintedLine> lines)
      : lines_(std::move(lines)), partners_(2 * lines_.size(), kNone), is_joined_(lines_.size(), false) {
    match();
  }

  /// Joins all lines. Joined lines are in the order of their first parts, because the lower index is in front where
  /// lane marks overlap.
  std::vector<PaintedLine> join() {
    std::vector<PaintedLine> joined;
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      if (!is_joined_[line]) joined.push_back(join_chain(chain_begin(line)));
    }
    return joined;
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  Vec3 end_point(std::size_t end) const {
    const std::vector<Vec3>& points = lines_[end / 2].points_m;
    return end % 2 == 0 ? points.front() : points.back();
  }

  /// Returns the unit vector in plan that points out of the line at this end.
  Vec2 outward(std::size_t end) const {
    const std::vector<Vec3>& points = lines_[end / 2].points_m;
    const Vec3 before = end % 2 == 0 ? points[1] : points[points.size() - 2];
    const Vec2 out = (end_point(end) - before).xy();
    return out * (1.0f / length(out));
  }

  /// Pairs coincident ends, the straightest pair first. At a fork, only one branch is joined.
  void match() {
    struct Pair {
      // Sine of the angle between the lines, and distance between their ends.
      float bend = 0, gap_m = 0;
      std::size_t a = 0, b = 0;
    };
    std::vector<Aabb2> boxes;
    for (std::size_t end = 0; end < partners_.size(); ++end)
      boxes.push_back(box_around(end_point(end).xy(), end_point(end).xy(), kCoincident_m));
    const Grid grid(boxes, kPieceCell_m);
    std::vector<Pair> pairs;
    for (std::size_t a = 0; a < partners_.size(); ++a) {
      const Vec2 here = end_point(a).xy(), out = outward(a);
      visit_items(grid.view(), {here, here}, [&](std::size_t b) {
        if (b <= a || !have_equal_style(lines_[a / 2], lines_[b / 2])) return;
        const Vec2 other_out = outward(b);
        const float gap_m = length(end_point(a) - end_point(b)), bend = std::abs(cross(out, other_out));
        if (gap_m > kCoincident_m || bend > kMaxBend || dot(out, other_out) > 0) return;
        pairs.push_back({bend, gap_m, a, b});
      });
    }
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) {
      return std::tie(p.bend, p.gap_m, p.a, p.b) < std::tie(q.bend, q.gap_m, q.a, q.b);
    });
    for (const Pair& pair : pairs) {
      if (partners_[pair.a] != kNone || partners_[pair.b] != kNone) continue;
      partners_[pair.a] = pair.b;
      partners_[pair.b] = pair.a;
    }
  }

  /// Returns the end where the chain of this line begins. A ring begins with the line itself.
  std::size_t chain_begin(std::size_t line) const {
    std::size_t end = 2 * line;
    while (partners_[end] != kNone) {
      end = partners_[end] ^ 1;
      if (end == 2 * line) break;
    }
    return end;
  }

  /// Returns the joined line that begins with this end.
  PaintedLine join_chain(std::size_t begin) {
    const PaintedLine& first = lines_[begin / 2];
    PaintedLine joined{.width_m = first.width_m, .color = first.color};
    std::size_t end = begin;
    while (end != kNone && !is_joined_[end / 2]) {
      is_joined_[end / 2] = true;
      std::vector<Vec3>& points = lines_[end / 2].points_m;
      if (end % 2 == 1) std::reverse(points.begin(), points.end());
      joined.points_m.insert(joined.points_m.end(), points.begin() + (end == begin ? 0 : 1), points.end());
      end = partners_[end ^ 1];
    }
    if (end == begin) joined.points_m.back() = joined.points_m.front();
    return joined;
  }

  std::vector<PaintedLine> lines_;
  std::vector<std::size_t> partners_;
  std::vector<bool> is_joined_;
};

/// Removes points within kThinningTolerance_m of the chords between the remaining points.
void thin(PaintedLine* line) {
  std::vector<CurvePoint> points;
  for (const Vec3 point : line->points_m) points.push_back({0, Eigen::Vector3d{point.x, point.y, point.z}, 0});
  std::vector<Vec3> thinned;
  for (const std::size_t i : thin_polyline(points, kThinningTolerance_m, kMaxChord_m))
    thinned.push_back(line->points_m[i]);
  line->points_m = std::move(thinned);
}

}  // namespace

std::vector<PaintedLine> painted_lines(const RoadMap& map) {
  std::vector<PaintedLine> lines = LineJoiner(DuplicateLines(lines_of_markings(map)).remove()).join();
  for (PaintedLine& line : lines) thin(&line);
  return lines;
}

std::vector<RoadEdge> uncovered_edges(const RoadMap& map, const std::vector<PaintedLine>& lines, float width_m) {
  const PieceIndex pieces(lines);
  std::vector<RoadEdge> uncovered;
  for (const RoadEdge& edge : map.road_edges) {
    const bool is_covered = pieces.is_covered(edge.a_m, edge.b_m, kCoveredEdgeTolerance_m, [&](std::size_t line) {
      return kCoveredEdgeTolerance_m - 0.5f * (width_m - lines[line].width_m);
    });
    if (!is_covered) uncovered.push_back(edge);
  }
  return uncovered;
}

}  // namespace pictura
