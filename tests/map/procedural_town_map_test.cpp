// Procedural towns after import: one connected network of lanes, with no obstacles on them.
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/common/grid.h"
#include "pictura/common/rng.h"
#include "pictura/map/lane_graph.h"
#include "pictura/map/map_geometry.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/procedural/procedural_town.h"
#include "pictura/map/surface.h"
#include "pictura/tests/map/town_options.h"

namespace pictura {
namespace {

constexpr float kLevel_m = 2;

Vec2 direction(float heading_rad) { return {std::cos(heading_rad), std::sin(heading_rad)}; }

bool segments_cross(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  const auto side = [](Vec2 p, Vec2 q, Vec2 r) { return cross(q - p, r - p); };
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

/// Calls visit(pose) along a lane, every `step_m` and at its ends.
template <typename Visit>
void along(const RoadMap& map, const Lane& lane, float step_m, Visit&& visit) {
  const Span<const LanePoint> points = map.points_of(lane);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const LanePoint &a = points[i - 1], &b = points[i];
    const int steps = std::max(1, static_cast<int>(std::ceil((b.s_m - a.s_m) / step_m)));
    for (int k = i == 1 ? 0 : 1; k <= steps; ++k) {
      const float u = static_cast<float>(k) / static_cast<float>(steps);
      visit(LanePoint{a.position_m + (b.position_m - a.position_m) * u,
                      a.heading_rad + u * wrap_angle(b.heading_rad - a.heading_rad),
                      a.width_m + u * (b.width_m - a.width_m), a.s_m + u * (b.s_m - a.s_m)});
    }
  }
}

Vec3 offset_left(const LanePoint& pose, float left_m) {
  const Vec2 left = left_normal(direction(pose.heading_rad)) * left_m;
  return {pose.position_m.x + left.x, pose.position_m.y + left.y, pose.position_m.z};
}

/// All lanes as bands, with queries for the lanes that cover a point.
class LaneSurface {
 public:
  LaneSurface(const RoadMap& map, double level_m) : surface_(bands_of(map), level_m) {}

  /// Whether a lane that satisfies `counts` covers p.
  template <typename Counts>
  bool covers(Vec3 p, Counts&& counts) const {
    return surface_.any_band_at({static_cast<double>(p.x), static_cast<double>(p.y)}, static_cast<double>(p.z), counts);
  }

 private:
  static std::vector<SurfaceBand> bands_of(const RoadMap& map) {
    std::vector<SurfaceBand> bands;
    for (const Lane& lane : map.lanes) {
      SurfaceBand& band = bands.emplace_back();
      along(map, lane, 1, [&](const LanePoint& pose) {
        const auto add = [&](std::vector<Eigen::Vector3d>* border, float left_m) {
          const Vec3 p = offset_left(pose, left_m);
          border->emplace_back(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
        };
        add(&band.left, 0.5f * pose.width_m);
        add(&band.right, -0.5f * pose.width_m);
      });
    }
    return bands;
  }

  Surface surface_;
};

/// Road edges in a grid, for intersection queries.
class Edges {
 public:
  explicit Edges(const RoadMap& map) : map_(map) {
    std::vector<Aabb2> boxes;
    for (const RoadEdge& edge : map.road_edges) {
      boxes.push_back({{min_of(edge.a_m.x, edge.b_m.x), min_of(edge.a_m.y, edge.b_m.y)},
                       {max_of(edge.a_m.x, edge.b_m.x), max_of(edge.a_m.y, edge.b_m.y)}});
    }
    grid_ = Grid(boxes, 5.0f);
  }

  /// Whether an edge at this height crosses the segment.
  bool cross(Vec3 a, Vec3 b) const {
    const GridView grid = grid_.view();
    for (int iy = grid.cell_y(min_of(a.y, b.y)); iy <= grid.cell_y(max_of(a.y, b.y)); ++iy) {
      for (int ix = grid.cell_x(min_of(a.x, b.x)); ix <= grid.cell_x(max_of(a.x, b.x)); ++ix) {
        const auto cell = static_cast<std::size_t>(iy * grid.num_x + ix);
        for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
          const RoadEdge& e = map_.road_edges[grid.items[i]];
          if (std::abs(0.5f * (e.a_m.z + e.b_m.z) - a.z) < kLevel_m &&
              segments_cross(a.xy(), b.xy(), e.a_m.xy(), e.b_m.xy())) {
            return true;
          }
        }
      }
    }
    return false;
  }

 private:
  const RoadMap& map_;
  Grid grid_;
};

class Town {
 public:
  explicit Town(const TownOptions& options)
      : map_(parse_opendrive(procedural_town(options), "town")), surface_(map_, 2 * kLevel_m), edges_(map_) {}

  void check() {
    validate(map_);
    EXPECT_TRUE(map_.mends.empty()) << map_.mends.front().message;
    check_network();
    check_driving();
    check_overlaps();
    check_lights();
    check_phases();
    check_objects();
  }

 private:
  const Lane& lane(int32_t index) const { return map_.lanes[index]; }
  const LanePoint& first(const Lane& of) const { return map_.points_of(of)[0]; }
  const LanePoint& last(const Lane& of) const { return map_.points_of(of)[map_.points_of(of).size() - 1]; }

  /// Checks that every driving lane leads to all others and is endless.
  void check_network() {
    const LaneComponents components = LaneGraph(map_).components();
    std::set<int32_t> found;
    for (std::size_t i = 0; i < map_.lanes.size(); ++i) {
      if (map_.lanes[i].type != LaneType::driving) continue;
      found.insert(components.of_lane[i]);
      EXPECT_TRUE(map_.lanes[i].is_endless) << name(map_.lanes[i]);
      EXPECT_GE(map_.lanes[i].successors.size(), 1) << name(map_.lanes[i]);
    }
    EXPECT_EQ(found.size(), 1u);
    for (const Lane& from : map_.lanes) {
      for (const int32_t to : map_.links(from.successors)) {
        EXPECT_LT(length(first(lane(to)).position_m - last(from).position_m), 1e-3f) << name(from);
        EXPECT_LT(std::abs(wrap_angle(first(lane(to)).heading_rad - last(from).heading_rad)), 0.01f) << name(from);
      }
    }
  }

  /// Checks that a car of 4.5 x 2 m in the middle of its lane touches no road edge, and that the lane's ends are open.
  void check_driving() {
    for (const Lane& driven_lane : map_.lanes) {
      if (driven_lane.type != LaneType::driving && driven_lane.type != LaneType::ramp) continue;
      along(map_, driven_lane, 1, [&](const LanePoint& pose) {
        constexpr float kTaper_m = 17;  // a slip lane opens from zero width
        if (driven_lane.type == LaneType::ramp && pose.s_m < kTaper_m) return;
        const Vec2 forward = direction(pose.heading_rad) * 2.25f;
        std::array<Vec3, 4> corners;
        for (std::size_t k = 0; k < 4; ++k) {
          const float sign = k < 2 ? 1.0f : -1.0f;
          const Vec3 side = offset_left(pose, k == 0 || k == 3 ? 1.0f : -1.0f);
          corners[k] = {side.x + sign * forward.x, side.y + sign * forward.y, side.z};
        }
        for (std::size_t k = 0; k < 4; ++k) {
          EXPECT_FALSE(edges_.cross(corners[k], corners[(k + 1) % 4])) << name(driven_lane) << " at " << pose.s_m;
        }
      });
      for (const LanePoint& end : {first(driven_lane), last(driven_lane)}) {
        const float half_m = 0.5f * end.width_m - 0.1f;
        if (half_m <= 0) continue;
        EXPECT_FALSE(edges_.cross(offset_left(end, half_m), offset_left(end, -half_m))) << name(driven_lane);
      }
    }
  }

  /// Checks that lanes of different roads do not overlap, except at different heights or in one junction.
  void check_overlaps() {
    constexpr float kInset_m = 0.1f;
    for (const Lane& own : map_.lanes) {
      along(map_, own, 2, [&](const LanePoint& pose) {
        const bool at_end = pose.s_m < kInset_m || pose.s_m > own.length_m - kInset_m;
        if (at_end || pose.width_m < 4 * kInset_m) return;
        for (const float side : {-1.0f, 0.0f, 1.0f}) {
          const Vec3 p = offset_left(pose, side * (0.5f * pose.width_m - kInset_m));
          EXPECT_FALSE(surface_.covers(p,
                                       [&](int32_t other) {
                                         return lane(other).source_road != own.source_road &&
                                                (!own.in_junction || own.junction != lane(other).junction);
                                       }))
              << name(own) << " at " << pose.s_m;
        }
      });
    }
  }

  /// Checks that lights stop their lanes at the junction's mouth and are visible from there and from further back.
  void check_lights() {
    const float min_cosine = std::cos(MapGeometryOptions().light_half_angle_rad);
    for (std::size_t i = 0; i < map_.lights.size(); ++i) {
      const TrafficLight& light = map_.lights[i];
      const Vec2 stop = (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f;
      EXPECT_GT(dot(light.head_m.xy() - stop, direction(light.stop_heading_rad)), 1.0f) << light.name;
      int incoming = 0, connecting = 0;
      for (int32_t k = light.lanes.begin; k < light.lanes.end; ++k) {
        const Lane& controlled = lane(map_.light_lanes[k]);
        ++(controlled.in_junction ? connecting : incoming);
        if (controlled.in_junction) continue;
        EXPECT_EQ(controlled.type, LaneType::driving) << "slip lanes bypass the light";
        EXPECT_LT(std::abs(dot(last(controlled).position_m.xy() - stop, direction(light.stop_heading_rad))), 0.01f);
        for (const float back_m : {0.0f, 5.0f, 15.0f}) {
          if (back_m > controlled.length_m) continue;
          Vec3 eye{};
          along(map_, controlled, 0.5f, [&](const LanePoint& pose) {
            if (pose.s_m <= controlled.length_m - back_m + 0.01f) eye = pose.position_m;
          });
          eye.z += 1.5f;
          const Vec3 to_eye = eye - light.head_m;
          EXPECT_GT(dot(light.head_facing, to_eye.xy()), min_cosine * length(to_eye))
              << light.name << " from " << back_m;
        }
      }
      EXPECT_GE(incoming, 1);
      EXPECT_GE(connecting, 1);
    }
  }

  /// Checks that paths with simultaneous green lights do not cross.
  void check_phases() {
    std::map<std::pair<int32_t, int32_t>, std::set<int32_t>> greens;
    for (const TrafficLight& light : map_.lights) {
      for (int32_t k = light.lanes.begin; k < light.lanes.end; ++k) {
        const int32_t controlled = map_.light_lanes[k];
        if (lane(controlled).in_junction) greens[{light.junction, light.phase}].insert(controlled);
      }
    }
    for (const auto& [phase, lanes] : greens) {
      for (const int32_t a : lanes) {
        for (const int32_t b : lanes) {
          if (a >= b || length(first(lane(a)).position_m - first(lane(b)).position_m) < 0.1f) continue;
          const Span<const LanePoint> p = map_.points_of(lane(a)), q = map_.points_of(lane(b));
          for (std::size_t i = 1; i < p.size(); ++i) {
            for (std::size_t j = 1; j < q.size(); ++j) {
              EXPECT_FALSE(segments_cross(p[i - 1].position_m.xy(), p[i].position_m.xy(), q[j - 1].position_m.xy(),
                                          q[j].position_m.xy()))
                  << name(lane(a)) << " and " << name(lane(b));
            }
          }
        }
      }
    }
  }

  /// Checks that crosswalks are in junctions, parking spaces only on parking lanes, and building lines clear of all
  /// lanes.
  void check_objects() {
    for (const Crosswalk& crosswalk : map_.crosswalks) {
      std::array<Vec3, 4> corners;
      ASSERT_EQ(crosswalk.outline.size(), 4);
      for (std::size_t k = 0; k < 4; ++k) {
        corners[k] = map_.outline_points[static_cast<std::size_t>(crosswalk.outline.begin) + k];
      }
      // A crosswalk crosses the junction's lanes, possibly with an island between them.
      constexpr int kSteps = 20;
      int on_lanes = 0;
      for (int k = 0; k <= kSteps; ++k) {
        const float u = static_cast<float>(k) / kSteps;
        for (const auto& [from, to] : {std::pair{corners[0], corners[3]}, {corners[1], corners[2]}}) {
          EXPECT_FALSE(surface_.covers(from + (to - from) * u,
                                       [&](int32_t i) { return is_drivable(lane(i).type) && !lane(i).in_junction; }));
        }
        const Vec3 p = (corners[0] + corners[1]) * (0.5f * (1 - u)) + (corners[2] + corners[3]) * (0.5f * u);
        on_lanes += surface_.covers(p, [&](int32_t i) { return lane(i).in_junction; }) ? 1 : 0;
      }
      EXPECT_GT(on_lanes, kSteps / 2);
    }
    for (const ParkingSpace& space : map_.parking_spaces) {
      LanePoint pose;
      pose.position_m = space.center_m;
      pose.heading_rad = space.heading_rad;
      for (const float ahead : {-0.5f, 0.0f, 0.5f}) {
        for (const float left : {-0.5f, 0.0f, 0.5f}) {
          Vec3 p = offset_left(pose, left * space.width_m);
          p = p + Vec3{direction(space.heading_rad).x, direction(space.heading_rad).y, 0} * (ahead * space.length_m);
          EXPECT_FALSE(surface_.covers(p, [&](int32_t i) { return lane(i).type != LaneType::parking; }));
          EXPECT_TRUE(surface_.covers(p, [&](int32_t i) { return lane(i).type == LaneType::parking; }));
        }
      }
    }
    const LaneSurface any_level(map_, 1e9);
    for (const BuildingLine& line : map_.building_lines) {
      for (const float u : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f}) {
        EXPECT_FALSE(any_level.covers(line.a_m + (line.b_m - line.a_m) * u, [](int32_t) { return true; }));
      }
    }
  }

  std::string name(const Lane& of) const {
    return fmt::format("road {} section {} lane {}", map_.road_names[of.source_road], of.source_section,
                       of.source_lane);
  }

  RoadMap map_;
  LaneSurface surface_;
  Edges edges_;
};

/// Returns false after a failure.
bool expect_valid(const TownOptions& options) {
  std::string text = fmt::format("procedural:{}:blocks={}x{}", options.seed, options.blocks_x, options.blocks_y);
  for (const TownFeature& feature : town_features())
    text += fmt::format(",{}={}", feature.name, options.*feature.value);
  SCOPED_TRACE(text);
  Town(options).check();
  return !testing::Test::HasFailure();
}

/// Number of seeds: PICTURA_TOWN_SEEDS, or fifty.
uint64_t num_seeds() {
  const char* const requested = std::getenv("PICTURA_TOWN_SEEDS");
  return requested ? std::strtoull(requested, nullptr, 10) : 50;
}

TEST(ProceduralTownMap, SmallTownsAreValid) {
  constexpr std::array<std::array<int, 2>, 5> kSizes{{{1, 1}, {1, 2}, {2, 2}, {3, 1}, {3, 3}}};
  for (uint64_t seed = 0; seed < num_seeds(); ++seed) {
    const auto& [x, y] = kSizes[seed % kSizes.size()];
    if (!expect_valid(test::options_of(seed, x, y))) return;
  }
}

TEST(ProceduralTownMap, TownsWithRandomOptionsAreValid) {
  for (uint64_t seed = 0; seed < num_seeds() / 2; ++seed) {
    TownOptions options = test::options_of(seed, 2, 2);
    RandomStream stream({.seed = seed, .purpose = Purpose::town});
    for (const TownFeature& feature : town_features()) {
      const double value = feature.low + (feature.high - feature.low) * static_cast<double>(stream.uniform());
      options.*feature.value = feature.is_whole ? std::round(value) : value;
    }
    if (!expect_valid(options)) return;
  }
}

TEST(ProceduralTownMap, TownsWithMixedOptionsAreValid) {
  for (uint64_t seed = 0; seed < num_seeds() / 4; ++seed) {
    if (!expect_valid(test::mixed_options(seed, 2, 2, seed % 2 == 0 ? "city" : "procedural"))) return;
  }
}

TEST(ProceduralTownMap, TownsWithOneFeatureAtItsMinimumOrMaximumAreValid) {
  uint64_t seed = 1000;
  for (const TownFeature& feature : town_features()) {
    for (const double value : {feature.low, feature.high}) {
      TownOptions options = test::options_of(seed++, 3, 2);
      options.*feature.value = value;
      if (!expect_valid(options)) return;
    }
  }
}

TEST(ProceduralTownMap, CitiesAreValid) {
  constexpr std::array<std::array<int, 2>, 5> kSizes{{{3, 3}, {1, 2}, {2, 2}, {4, 3}, {1, 1}}};
  for (uint64_t seed = 0; seed < num_seeds(); ++seed) {
    const auto& [x, y] = seed < 20 ? kSizes[0] : kSizes[seed % kSizes.size()];
    if (!expect_valid(test::options_of(seed, x, y, "city"))) return;
  }
}

// A single town, because it takes half a minute of a core.
TEST(ProceduralTownMap, TheLargestTownIsRead) {
  const std::string text = procedural_town(test::options_of(0, kMaxTownBlocks, kMaxTownBlocks));
  EXPECT_GT(parse_opendrive(text, "largest").lanes.size(), 10'000u);
}

TEST(ProceduralTownMap, LargeTownsAreValid) { expect_valid(test::options_of(100, 7, 6)); }

class ProceduralTownMapOf : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Family, ProceduralTownMapOf, testing::Values("procedural", "city"));

TEST_P(ProceduralTownMapOf, OverpassesHaveClearanceBelow) {
  TownOptions options = test::options_of(4, 3, 3, GetParam());
  options.hills_m = 50;
  const RoadMap map = parse_opendrive(procedural_town(options), "town");
  float min_clearance_m = 1e9f;
  int crossings = 0;
  for (const Lane& a : map.lanes) {
    for (const Lane& b : map.lanes) {
      if (a.source_road >= b.source_road || a.in_junction || b.in_junction) continue;
      const Span<const LanePoint> p = map.points_of(a), q = map.points_of(b);
      for (std::size_t i = 1; i < p.size(); ++i) {
        for (std::size_t j = 1; j < q.size(); ++j) {
          if (!segments_cross(p[i - 1].position_m.xy(), p[i].position_m.xy(), q[j - 1].position_m.xy(),
                              q[j].position_m.xy())) {
            continue;
          }
          // Heights where the pieces cross.
          const Vec3 p_way = p[i].position_m - p[i - 1].position_m, q_way = q[j].position_m - q[j - 1].position_m;
          const Vec3 apart = q[j - 1].position_m - p[i - 1].position_m;
          const float turn = cross(p_way.xy(), q_way.xy());
          const float u = cross(apart.xy(), q_way.xy()) / turn, v = cross(apart.xy(), p_way.xy()) / turn;
          min_clearance_m = min_of(min_clearance_m, std::abs(apart.z + v * q_way.z - u * p_way.z));
          ++crossings;
        }
      }
    }
  }
  EXPECT_GT(crossings, 3);
  EXPECT_GE(min_clearance_m, 5.0f);
}

}  // namespace
}  // namespace pictura
