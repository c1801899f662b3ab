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

// What is nearer than this is at one place: ends that meet, and paint that is there twice. Of the ends in CARLA's towns
// that another continues within 1 cm, it does so within 1 mm for 99 %.
constexpr float kSame_m = 1e-3f;
// A repeated line may lie aside of the one that is drawn, end before it does, and the drawn one's pieces may each move
// where they were joined; thinning has what is left of the tolerance.
constexpr float kThinning_m = kPaintTolerance_m - 3 * kSame_m;
constexpr float kMaxBend = 0.25f;                    // sine of the angle between lines that continue each other
constexpr float kLongestChord_m = 10 * kMaxPiece_m;  // bounds the time of thinning; chords are drawn in even pieces
constexpr float kCell_m = 20.0f;

bool is_same_paint(const PaintedLine& a, const PaintedLine& b) { return a.width_m == b.width_m && a.color == b.color; }

Aabb2 box_around(Vec2 a, Vec2 b, float margin_m) {
  return {{min_of(a.x, b.x) - margin_m, min_of(a.y, b.y) - margin_m},
          {max_of(a.x, b.x) + margin_m, max_of(a.y, b.y) + margin_m}};
}

std::vector<PaintedLine> lines_of(const RoadMap& map) {
  std::vector<PaintedLine> lines;
  for (const Marking& marking : map.markings) {
    PaintedLine line{.width_m = marking.width_m, .color = marking.color};
    for (int32_t i = marking.points.begin; i < marking.points.end; ++i) {
      const Vec3 point = map.marking_points[static_cast<std::size_t>(i)];
      if (line.points_m.empty() || length((point - line.points_m.back()).xy()) >= kRepeatedPoint_m) {
        line.points_m.push_back(point);
      }
    }
    if (line.points_m.size() >= 2) lines.push_back(std::move(line));
  }
  return lines;
}

/// Pieces of lines, to be asked whether they run along a way.
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
        boxes.push_back(box_around(points[i - 1].xy(), points[i].xy(), kSame_m));
      }
    }
    grid_ = Grid(boxes, kCell_m);
  }

  const std::vector<Piece>& pieces() const { return pieces_; }

  /// Whether there is, beside all of the straight way from a to b, some piece within tolerance_m(line), negative for
  /// lines that do not count. It is at most max_m; gaps so short do not matter.
  template <typename Tolerance>
  bool run_along(Vec3 a_m, Vec3 b_m, float max_m, const Tolerance& tolerance_m) const {
    const float length_m = length(b_m - a_m);
    const Way way{a_m, (b_m - a_m) * (1.0f / length_m), length_m};
    std::vector<Stretch> accompanied;
    visit_items(grid_.view(), box_around(a_m.xy(), b_m.xy(), max_m), [&](std::size_t i) {
      const float its_tolerance_m = tolerance_m(pieces_[i].line);
      if (its_tolerance_m < 0) return;
      const Stretch shared = shared_stretch(way, pieces_[i], its_tolerance_m);
      if (shared.end_m > shared.begin_m) accompanied.push_back(shared);
    });
    std::sort(accompanied.begin(), accompanied.end(), [](Stretch a, Stretch b) { return a.begin_m < b.begin_m; });
    float reached_m = 0;
    for (const Stretch& stretch : accompanied) {
      if (stretch.begin_m > reached_m + max_m) return false;
      reached_m = max_of(reached_m, stretch.end_m);
    }
    return !accompanied.empty() && reached_m >= length_m - max_m;
  }

 private:
  struct Way {
    Vec3 begin_m, along;  // along: a unit vector
    float length_m = 0;
  };
  /// A part of a way, in metres from its beginning.
  struct Stretch {
    float begin_m = 0, end_m = 0;
  };

  /// The part of a way that has a piece beside it, if all that the piece has there is that near; else none.
  static Stretch shared_stretch(const Way& way, const Piece& piece, float tolerance_m) {
    const float a_m = dot(piece.a_m - way.begin_m, way.along), b_m = dot(piece.b_m - way.begin_m, way.along);
    const Stretch beside{max_of(min_of(a_m, b_m), 0.0f), min_of(max_of(a_m, b_m), way.length_m)};
    if (beside.end_m <= beside.begin_m) return {};
    for (const float at_m : {beside.begin_m, beside.end_m}) {
      const Vec3 place_m = piece.a_m + (piece.b_m - piece.a_m) * ((at_m - a_m) / (b_m - a_m));
      if (length(place_m - (way.begin_m + way.along * at_m)) > tolerance_m) return {};
    }
    return beside;
  }

  std::vector<Piece> pieces_;
  Grid grid_;
};

/// Leaves out lines all of whose length others paint too: roads of a junction that run over each other bring the same
/// paint, cut in other places. Longer lines are kept first, so that what a line is left out for is never left out.
class RepeatedPaint {
 public:
  explicit RepeatedPaint(std::vector<PaintedLine> lines)
      : lines_(std::move(lines)), kept_(lines_.size(), false), pieces_(lines_) {}

  std::vector<PaintedLine> leave_out() {
    std::vector<float> lengths_m(lines_.size(), 0.0f);
    for (const PieceIndex::Piece& piece : pieces_.pieces()) lengths_m[piece.line] += length(piece.b_m - piece.a_m);
    std::vector<std::size_t> order(lines_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return lengths_m[a] > lengths_m[b]; });
    for (const std::size_t line : order) {
      const std::vector<Vec3>& points = lines_[line].points_m;
      for (std::size_t i = 1; i < points.size() && !kept_[line]; ++i) {
        kept_[line] = !is_painted(line, points[i - 1], points[i]);
      }
    }
    std::vector<PaintedLine> once;
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      if (kept_[line]) once.push_back(std::move(lines_[line]));
    }
    return once;
  }

 private:
  /// Whether lines that are kept paint all of a piece of a line.
  bool is_painted(std::size_t line, Vec3 a_m, Vec3 b_m) const {
    return pieces_.run_along(a_m, b_m, kSame_m, [&](std::size_t other) {
      return kept_[other] && is_same_paint(lines_[other], lines_[line]) ? kSame_m : -1.0f;
    });
  }

  std::vector<PaintedLine> lines_;
  std::vector<bool> kept_;
  PieceIndex pieces_;
};

/// Joins lines end to end, whichever way round they are. End 2 * i is the first point of line i, end 2 * i + 1 its
/// last.
class LineJoiner {
 public:
  explicit LineJoiner(std::vector<PaintedLine> lines)
      : lines_(std::move(lines)), partner_(2 * lines_.size(), kNone), used_(lines_.size(), false) {
    match();
  }

  /// In the order of their first lines: where lane marks overlap, the lower index is in front.
  std::vector<PaintedLine> join() {
    std::vector<PaintedLine> joined;
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      if (!used_[line]) joined.push_back(follow(begin_of(line)));
    }
    return joined;
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  Vec3 place(std::size_t end) const {
    const std::vector<Vec3>& points = lines_[end / 2].points_m;
    return end % 2 == 0 ? points.front() : points.back();
  }

  /// The unit vector in plan that leads out of the line.
  Vec2 outward(std::size_t end) const {
    const std::vector<Vec3>& points = lines_[end / 2].points_m;
    const Vec3 before = end % 2 == 0 ? points[1] : points[points.size() - 2];
    const Vec2 out = (place(end) - before).xy();
    return out * (1.0f / length(out));
  }

  /// Ends that meet in pairs, the straightest first: where lines fork, one branch goes on.
  void match() {
    struct Pair {
      float bend = 0, gap_m = 0;  // sine of the angle between the lines; how far apart they end
      std::size_t a = 0, b = 0;
    };
    std::vector<Aabb2> boxes;
    for (std::size_t end = 0; end < partner_.size(); ++end)
      boxes.push_back(box_around(place(end).xy(), place(end).xy(), kSame_m));
    const Grid grid(boxes, kCell_m);
    std::vector<Pair> pairs;
    for (std::size_t a = 0; a < partner_.size(); ++a) {
      const Vec2 here = place(a).xy(), out = outward(a);
      visit_items(grid.view(), {here, here}, [&](std::size_t b) {
        if (b <= a || !is_same_paint(lines_[a / 2], lines_[b / 2])) return;
        const Vec2 other_out = outward(b);
        const float gap_m = length(place(a) - place(b)), bend = std::abs(cross(out, other_out));
        if (gap_m > kSame_m || bend > kMaxBend || dot(out, other_out) > 0) return;
        pairs.push_back({bend, gap_m, a, b});
      });
    }
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) {
      return std::tie(p.bend, p.gap_m, p.a, p.b) < std::tie(q.bend, q.gap_m, q.a, q.b);
    });
    for (const Pair& pair : pairs) {
      if (partner_[pair.a] != kNone || partner_[pair.b] != kNone) continue;
      partner_[pair.a] = pair.b;
      partner_[pair.b] = pair.a;
    }
  }

  /// Where what the line is a part of begins; rings begin with the line.
  std::size_t begin_of(std::size_t line) const {
    std::size_t end = 2 * line;
    while (partner_[end] != kNone) {
      end = partner_[end] ^ 1;
      if (end == 2 * line) break;
    }
    return end;
  }

  /// The line that begins with this end.
  PaintedLine follow(std::size_t begin) {
    const PaintedLine& first = lines_[begin / 2];
    PaintedLine joined{.width_m = first.width_m, .color = first.color};
    std::size_t end = begin;
    while (end != kNone && !used_[end / 2]) {
      used_[end / 2] = true;
      std::vector<Vec3>& points = lines_[end / 2].points_m;
      if (end % 2 == 1) std::reverse(points.begin(), points.end());
      joined.points_m.insert(joined.points_m.end(), points.begin() + (end == begin ? 0 : 1), points.end());
      end = partner_[end ^ 1];
    }
    if (end == begin) joined.points_m.back() = joined.points_m.front();
    return joined;
  }

  std::vector<PaintedLine> lines_;
  std::vector<std::size_t> partner_;
  std::vector<bool> used_;
};

/// Leaves out points that the chords between the others pass within kThinning_m.
void thin(PaintedLine* line) {
  std::vector<CurvePoint> points;
  for (const Vec3 point : line->points_m) points.push_back({0, point.x, point.y, point.z, 0});
  std::vector<Vec3> kept;
  for (const std::size_t i : thin_polyline(points, kThinning_m, kLongestChord_m)) kept.push_back(line->points_m[i]);
  line->points_m = std::move(kept);
}

}  // namespace

std::vector<PaintedLine> painted_lines(const RoadMap& map) {
  std::vector<PaintedLine> lines = LineJoiner(RepeatedPaint(lines_of(map)).leave_out()).join();
  for (PaintedLine& line : lines) thin(&line);
  return lines;
}

std::vector<RoadEdge> edges_beside(const RoadMap& map, const std::vector<PaintedLine>& lines, float width_m) {
  const PieceIndex pieces(lines);
  std::vector<RoadEdge> seen;
  for (const RoadEdge& edge : map.road_edges) {
    const bool is_hidden = pieces.run_along(edge.a_m, edge.b_m, kHiddenEdge_m, [&](std::size_t line) {
      return kHiddenEdge_m - 0.5f * (width_m - lines[line].width_m);
    });
    if (!is_hidden) seen.push_back(edge);
  }
  return seen;
}

}  // namespace pictura
