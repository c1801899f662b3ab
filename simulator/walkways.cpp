#include "pictura/simulator/walkways.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include <fmt/format.h>

#include "pictura/common/support/interrupt.h"
#include "pictura/simulator/rules/road.h"

namespace pictura {
namespace {

constexpr float kSamePlace_m = 0.75f;     // ends of lanes within this distance are joined
constexpr float kMinPiece_m = 0.05f;      // minimum length of a piece
constexpr float kCrossingReach_m = 8.0f;  // maximum distance from the end of a crosswalk to a walkway

struct Edge {
  int32_t a = 0, b = 0;  // nodes
};

struct Network {
  std::vector<Vec3> nodes;
  std::vector<Edge> edges;

  int32_t add_node(Vec3 at) {
    nodes.push_back(at);
    return static_cast<int32_t>(nodes.size()) - 1;
  }
  Vec3 at(int32_t node) const { return nodes[node]; }
};

bool same_place(Vec3 a, Vec3 b) { return length((a - b).xy()) < kSamePlace_m && std::fabs(a.z - b.z) < kLevel_m; }

/// Adds the centre lines of sidewalks or shoulders.
void add_lanes(const RoadMap& map, Network* out) {
  const auto is_sidewalk = [](const Lane& lane) { return lane.type == LaneType::sidewalk; };
  const bool has_sidewalks = std::any_of(map.lanes.begin(), map.lanes.end(), is_sidewalk);
  const LaneType walked = has_sidewalks ? LaneType::sidewalk : LaneType::shoulder;
  std::vector<int32_t> ends;
  for (const Lane& lane : map.lanes) {
    if (lane.type != walked) continue;
    const Span<const LanePoint> points = map.points_of(lane);
    int32_t before = out->add_node(points[0].position_m);
    ends.push_back(before);
    for (size_t i = 1; i < points.size(); ++i) {
      const int32_t node = out->add_node(points[i].position_m);
      out->edges.push_back({before, node});
      before = node;
    }
    ends.push_back(before);
  }
  // Ends of lanes that meet are joined. The ends are sorted by x, so that only near ends are compared.
  std::sort(ends.begin(), ends.end(), [out](int32_t a, int32_t b) {
    return out->at(a).x < out->at(b).x || (out->at(a).x == out->at(b).x && a < b);
  });
  std::vector<int32_t> place(out->nodes.size());
  std::iota(place.begin(), place.end(), 0);
  for (size_t i = 0; i < ends.size(); ++i) {
    for (size_t j = i + 1; j < ends.size() && out->at(ends[j]).x - out->at(ends[i]).x < kSamePlace_m; ++j) {
      if (!same_place(out->at(ends[i]), out->at(ends[j]))) continue;
      int32_t& later = place[ends[j]];
      if (later == ends[j]) later = place[ends[i]];
    }
  }
  for (Edge& edge : out->edges) {
    edge.a = place[edge.a];
    edge.b = place[edge.b];
  }
}

/// Removes edges that are too short for a piece, and edges whose middle is on the road.
void drop_edges_on_road(const MapView& roads, Network* out) {
  const auto is_unfit = [&](const Edge& edge) {
    const Vec3 a = out->at(edge.a), b = out->at(edge.b), middle = (a + b) * 0.5f;
    return length((b - a).xy()) < kMinPiece_m || is_on_road(roads, middle.xy(), middle.z);
  };
  out->edges.erase(std::remove_if(out->edges.begin(), out->edges.end(), is_unfit), out->edges.end());
}

/// Computes the centre line of a crosswalk: that of the minimum-area rectangle around its outline, parallel to the
/// longer side.
void add_middle_line(Span<const Vec3> outline, Vec3* a_out, Vec3* b_out) {
  float min_area = INFINITY;
  for (size_t i = 0; i < outline.size(); ++i) {
    const Vec2 side = (outline[(i + 1) % outline.size()] - outline[i]).xy();
    const float side_m = length(side);
    if (!(side_m > 0)) continue;
    const Vec2 along = side * (1.0f / side_m), across = left_normal(along);
    Vec2 low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
    float z = 0;
    for (const Vec3& corner : outline) {
      const Vec2 p{dot(corner.xy(), along), dot(corner.xy(), across)};
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
      z += corner.z / static_cast<float>(outline.size());
    }
    const Vec2 size = high - low, middle = (low + high) * 0.5f;
    if (size.x * size.y >= min_area) continue;
    min_area = size.x * size.y;
    const Vec2 half = size.x >= size.y ? Vec2{0.5f * size.x, 0.0f} : Vec2{0.0f, 0.5f * size.y};
    const auto place = [&](Vec2 p) {
      const Vec2 xy = along * p.x + across * p.y;
      return Vec3{xy.x, xy.y, z};
    };
    *a_out = place(middle - half);
    *b_out = place(middle + half);
  }
}

/// Index of the walkways' edges by the square cells that they touch. It is updated when crosswalks split and add edges.
class EdgeCells {
 public:
  explicit EdgeCells(const Network& network) {
    for (size_t i = 0; i < network.edges.size(); ++i) add(network, i);
  }

  /// Adds an edge in pieces, so that a long diagonal edge is added to few cells.
  void add(const Network& network, size_t edge) {
    const Vec2 a = network.at(network.edges[edge].a).xy(), way = network.at(network.edges[edge].b).xy() - a;
    const int pieces = 1 + static_cast<int>(length(way) / kCell_m);
    for (int i = 0; i < pieces; ++i) {
      const Vec2 from = a + way * (static_cast<float>(i) / static_cast<float>(pieces));
      const Vec2 to = a + way * (static_cast<float>(i + 1) / static_cast<float>(pieces));
      visit(min_of(from.x, to.x), max_of(from.x, to.x), min_of(from.y, to.y), max_of(from.y, to.y),
            [&](uint64_t cell) { edges_of_[cell].push_back(edge); });
    }
  }

  /// Returns all edges within kReach_m of p, and possibly farther edges, in ascending order.
  const std::vector<size_t>& near(Vec2 p) {
    found_.clear();
    visit(p.x - kReach_m, p.x + kReach_m, p.y - kReach_m, p.y + kReach_m, [&](uint64_t cell) {
      const auto edges = edges_of_.find(cell);
      if (edges != edges_of_.end()) found_.insert(found_.end(), edges->second.begin(), edges->second.end());
    });
    std::sort(found_.begin(), found_.end());
    found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
    return found_;
  }

 private:
  static constexpr float kReach_m = kCrossingReach_m + 1, kCell_m = 2 * kReach_m;  // with a margin for rounding

  template <typename Visit>
  static void visit(float low_x, float high_x, float low_y, float high_y, Visit&& visit_cell) {
    const auto cell = [](float x_m) { return static_cast<int32_t>(std::floor(x_m / kCell_m)); };
    for (int32_t x = cell(low_x); x <= cell(high_x); ++x) {
      for (int32_t y = cell(low_y); y <= cell(high_y); ++y) {
        visit_cell(uint64_t{static_cast<uint32_t>(x)} << 32 | static_cast<uint32_t>(y));
      }
    }
  }

  std::unordered_map<uint64_t, std::vector<size_t>> edges_of_;
  std::vector<size_t> found_;
};

/// Returns a node at the point of the walkways nearest to p, or -1 if no point is within kCrossingReach_m. If the point
/// is between two nodes, splits the edge there.
int32_t node_near(Vec3 p, Network* network_inout, EdgeCells* cells_inout) {
  const size_t num_edges = network_inout->edges.size();
  size_t nearest = num_edges;
  float best_m = kCrossingReach_m, best_t = 0;
  for (const size_t i : cells_inout->near(p.xy())) {
    const Vec3 a = network_inout->at(network_inout->edges[i].a), b = network_inout->at(network_inout->edges[i].b);
    const Vec2 way = (b - a).xy();
    const float way2 = dot(way, way);
    const float t = way2 > 0 ? std::clamp(dot((p - a).xy(), way) / way2, 0.0f, 1.0f) : 0.0f;
    const float distance_m = length((p - a).xy() - way * t);
    if (distance_m >= best_m || std::fabs(a.z + (b.z - a.z) * t - p.z) >= kLevel_m) continue;
    best_m = distance_m;
    best_t = t;
    nearest = i;
  }
  if (nearest == num_edges) return -1;
  const Edge edge = network_inout->edges[nearest];
  const Vec3 a = network_inout->at(edge.a), way = network_inout->at(edge.b) - a;
  if (best_t * length(way.xy()) < kMinPiece_m) return edge.a;
  if ((1 - best_t) * length(way.xy()) < kMinPiece_m) return edge.b;
  const int32_t node = network_inout->add_node(a + way * best_t);
  network_inout->edges[nearest].b = node;
  network_inout->edges.push_back({node, edge.b});
  cells_inout->add(*network_inout, num_edges);
  return node;
}

void add_crosswalks(const RoadMap& map, Network* out) {
  const InterruptibleWork work(fmt::format("map {}: interrupted while it was compiled", map.name));
  EdgeCells cells(*out);
  for (const Crosswalk& crosswalk : map.crosswalks) {
    work.check();
    Vec3 end_m[2];
    const auto corners = static_cast<size_t>(crosswalk.outline.size());
    add_middle_line({map.outline_points.data() + crosswalk.outline.begin, corners}, &end_m[0], &end_m[1]);
    if (length((end_m[1] - end_m[0]).xy()) < kMinPiece_m) continue;
    int32_t before = -1;
    for (const Vec3& at : end_m) {
      const int32_t walk = node_near(at, out, &cells);
      const bool is_present = walk >= 0 && length((at - out->at(walk)).xy()) < kMinPiece_m;
      const int32_t end = is_present ? walk : out->add_node(at);
      if (walk >= 0 && !is_present) out->edges.push_back({walk, end});
      if (before >= 0) out->edges.push_back({before, end});
      before = end;
    }
  }
}

/// Removes connected networks that are too short for routes.
void drop_short_networks(Network* out) {
  std::vector<int32_t> root(out->nodes.size());
  std::iota(root.begin(), root.end(), 0);
  const auto root_of = [&root](int32_t node) {
    while (root[node] != node) {
      node = root[node] = root[root[node]];
    }
    return static_cast<size_t>(node);
  };
  for (const Edge& edge : out->edges) root[root_of(edge.a)] = static_cast<int32_t>(root_of(edge.b));
  std::vector<float> length_m(out->nodes.size(), 0);
  for (const Edge& edge : out->edges) length_m[root_of(edge.a)] += length((out->at(edge.b) - out->at(edge.a)).xy());
  out->edges.erase(std::remove_if(out->edges.begin(), out->edges.end(),
                                  [&](const Edge& edge) { return length_m[root_of(edge.a)] < kMinWalk_m; }),
                   out->edges.end());
}

WalkPiece piece_between(Vec3 a, Vec3 b, int32_t to_node) {
  const Vec2 way = (b - a).xy();
  WalkPiece piece;
  piece.a_m = a;
  piece.length_m = length(way);
  piece.direction = way * (1.0f / piece.length_m);
  piece.slope = (b.z - a.z) / piece.length_m;
  piece.heading_rad = std::atan2(way.y, way.x);
  piece.to_node = to_node;
  return piece;
}

}  // namespace

Walkways make_walkways(const RoadMap& map, const MapView& roads) {
  Network network;
  add_lanes(map, &network);
  drop_edges_on_road(roads, &network);
  add_crosswalks(map, &network);
  drop_short_networks(&network);

  Walkways out;
  std::vector<int32_t> from_node;
  float sum_m = 0;
  for (const Edge& edge : network.edges) {
    for (const auto& [from, to] : {std::pair{edge.a, edge.b}, std::pair{edge.b, edge.a}}) {
      out.pieces.push_back(piece_between(network.at(from), network.at(to), to));
      out.end_m.push_back(sum_m += out.pieces.back().length_m);
      from_node.push_back(from);
    }
  }
  out.leave_begin.assign(network.nodes.size() + 1, 0);
  for (const int32_t node : from_node) ++out.leave_begin[static_cast<size_t>(node) + 1];
  std::partial_sum(out.leave_begin.begin(), out.leave_begin.end(), out.leave_begin.begin());
  out.leaving.resize(out.pieces.size());
  std::vector<int32_t> next(out.leave_begin.begin(), out.leave_begin.end() - 1);
  for (size_t i = 0; i < from_node.size(); ++i) {
    out.leaving[next[from_node[i]]++] = static_cast<int32_t>(i);
  }
  for (size_t i = 0; i < out.pieces.size(); ++i) {
    WalkPiece& piece = out.pieces[i];
    const int32_t back = static_cast<int32_t>(i) ^ 1;
    const int32_t* const leaving = out.leaving.data() + out.leave_begin[piece.to_node];
    const int32_t ways = out.leave_begin[static_cast<size_t>(piece.to_node) + 1] - out.leave_begin[piece.to_node];
    piece.next = ways == 1 ? back : ways > 2 ? -1 : leaving[0] == back ? leaving[1] : leaving[0];
  }
  return out;
}

}  // namespace pictura
