// CARLA's eight towns: counts that are known from their files, and properties that every map must have.
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <map>

#include <gtest/gtest.h>

#include "pictura/common/scene.h"
#include "pictura/map/load_map.h"
#include "pictura/tests/map/driven_lanes.h"

namespace pictura {
namespace {

using test::drive_lanes;
using test::DrivenLanes;
using test::EdgeGrid;

struct TownFacts {
  const char* name;
  int roads, junction_roads, junctions;
  double driving_lane_km, driving_lane_km_in_junctions, z_min_m, z_max_m;
  int lights, signal_junctions;
  std::map<int, int> junctions_with_phases;
  int controlled_incoming_lanes, crosswalks, parking_spaces;
  int painted_stop_lines, painted_near_lights, stop_signs, yield_signs;
};

// Counted in the files without this importer. Town10HD has two more signals of the light type, without references.
const TownFacts kTowns[] = {
    {"Town01", 122, 96, 12, 6.4, 1.4, 0, 0, 36, 12, {{3, 12}}, 36, 0, 0, 0, 0, 0, 0},
    {"Town02", 84, 64, 8, 2.9, 0.8, 0, 0, 24, 8, {{3, 8}}, 24, 0, 0, 0, 0, 0, 0},
    {"Town03", 369, 287, 35, 13.8, 6.0, -0.9, 8.5, 38, 11, {{3, 6}, {4, 5}}, 55, 73, 121, 7, 0, 0, 0},
    {"Town04", 276, 223, 27, 33.4, 8.4, 0, 11, 43, 12, {{3, 5}, {4, 7}}, 50, 27, 0, 9, 5, 0, 0},
    {"Town05", 323, 270, 21, 23.9, 6.5, 0, 10, 54, 15, {{1, 1}, {3, 4}, {4, 10}}, 111, 66, 0, 10, 8, 5, 0},
    {"Town06", 200, 128, 23, 25.5, 6.4, 0, 0, 19, 8, {{2, 5}, {3, 3}}, 66, 14, 0, 17, 9, 0, 0},
    {"Town07", 277, 209, 31, 7.1, 2.7, -0.7, 9.4, 17, 5, {{3, 3}, {4, 2}}, 18, 7, 0, 1, 1, 19, 20},
    {"Town10HD", 108, 85, 9, 6.0, 2.8, 0, 0, 15, 5, {{2, 1}, {3, 3}, {4, 1}}, 30, 16, 0, 21, 15, 3, 1},
};

class CarlaTowns : public ::testing::TestWithParam<TownFacts> {
 protected:
  void SetUp() override {
    const std::string file = map_folder() + "/carla/" + GetParam().name + ".xodr";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "needs " << file << "; set PICTURA_DATA";
    const std::clock_t begin = std::clock();
    map_ = load_map(GetParam().name);
    load_s_ = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  }

  const Lane& lane(int32_t index) const { return map_->lanes[index]; }

  std::shared_ptr<const RoadMap> map_;
  double load_s_ = 0;
};

INSTANTIATE_TEST_SUITE_P(All, CarlaTowns, ::testing::ValuesIn(kTowns),
                         [](const ::testing::TestParamInfo<TownFacts>& town) { return std::string(town.param.name); });

TEST_P(CarlaTowns, MatchTheCountsOfTheirFiles) {
  const TownFacts& expected = GetParam();
  const MapFacts& facts = map_->facts;
  EXPECT_EQ(map_->name, expected.name);
  EXPECT_EQ(facts.roads, expected.roads);
  EXPECT_EQ(facts.junction_roads, expected.junction_roads);
  EXPECT_EQ(facts.junctions, expected.junctions);
  EXPECT_NEAR(facts.driving_lane_km, expected.driving_lane_km, 0.1);
  EXPECT_NEAR(facts.driving_lane_km_in_junctions, expected.driving_lane_km_in_junctions, 0.1);
  EXPECT_NEAR(facts.z_min_m, expected.z_min_m, 0.05);
  EXPECT_NEAR(facts.z_max_m, expected.z_max_m, 0.05);
  EXPECT_EQ(facts.traffic_lights, expected.lights);
  EXPECT_EQ(facts.stop_lines, expected.lights);
  EXPECT_EQ(facts.signal_junctions, expected.signal_junctions);
  EXPECT_EQ(facts.crosswalks, expected.crosswalks);
  EXPECT_EQ(facts.parking_spaces, expected.parking_spaces);
  std::map<int, int> phases;
  for (const Junction& junction : map_->junctions) {
    if (junction.num_phases > 0) ++phases[junction.num_phases];
  }
  EXPECT_EQ(phases, expected.junctions_with_phases);
  int incoming = 0;
  for (const TrafficLight& light : map_->lights) {
    for (int32_t i = light.lanes.begin; i < light.lanes.end; ++i) {
      incoming += lane(map_->light_lanes[i]).in_junction ? 0 : 1;
    }
  }
  EXPECT_EQ(incoming, expected.controlled_incoming_lanes);
  if (!PICTURA_IS_SANITIZED) {
    EXPECT_LT(load_s_, 2.0);
  }

  EXPECT_EQ(facts.painted_stop_lines, expected.painted_stop_lines);
  EXPECT_EQ(map_->stop_lines.size(), static_cast<std::size_t>(expected.painted_stop_lines));
  int near = 0;
  for (const PaintedStopLine& line : map_->stop_lines) {
    near += std::any_of(map_->lights.begin(), map_->lights.end(), [&](const TrafficLight& light) {
      const Vec2 painted = (line.a_m.xy() + line.b_m.xy()) * 0.5f;
      return length(painted - (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f) < 8.0f;
    });
  }
  EXPECT_EQ(near, expected.painted_near_lights);
  EXPECT_EQ(facts.signs, expected.stop_signs + expected.yield_signs);
  std::map<std::string, int> signs;
  for (const Sign& sign : map_->signs) {
    ++signs[sign.type];
    EXPECT_GT(sign.lanes.size(), 0) << sign.name;
  }
  EXPECT_EQ(signs["206"], expected.stop_signs);
  EXPECT_EQ(signs["205"], expected.yield_signs);
  EXPECT_FALSE(map_->geo_reference.empty());
}

TEST_P(CarlaTowns, LanesContinueEachOther) {
  double lane_km = 0;
  for (const Lane& from : map_->lanes) {
    if (from.type != LaneType::driving) continue;
    lane_km += 1e-3 * static_cast<double>(from.length_m);
    EXPECT_TRUE(from.is_endless);  // no town has a dead end
    const LanePoint end = map_->lane_points[static_cast<std::size_t>(from.points.end) - 1];
    for (const int32_t next : map_->links(from.successors)) {
      if (lane(next).type != LaneType::driving) continue;
      const LanePoint begin = map_->lane_points[lane(next).points.begin];
      EXPECT_LT(length(begin.position_m - end.position_m), 0.02);
      EXPECT_LT(std::abs(wrap_angle(begin.heading_rad - end.heading_rad)), 0.1);
    }
    for (const int32_t neighbor : {from.left_neighbor, from.right_neighbor}) {
      if (neighbor < 0) continue;
      const LanePoint neighbor_end = map_->lane_points[static_cast<std::size_t>(lane(neighbor).points.end) - 1];
      EXPECT_NEAR(length(neighbor_end.position_m - end.position_m), 0.5f * (neighbor_end.width_m + end.width_m), 0.01);
    }
  }
  // Lane lengths differ from the lengths along the reference lines only in curves.
  EXPECT_NEAR(lane_km, map_->facts.driving_lane_km, 0.01 * map_->facts.driving_lane_km);
}

TEST_P(CarlaTowns, LightsFaceTheirTrafficAtItsStopLine) {
  for (const TrafficLight& light : map_->lights) {
    const Vec2 heading{std::cos(light.stop_heading_rad), std::sin(light.stop_heading_rad)};
    EXPECT_NEAR(dot(light.head_facing, heading), -1, 1e-5);
    // Left end first, perpendicular to the traffic.
    const Vec2 line = light.stop_b_m.xy() - light.stop_a_m.xy();
    EXPECT_GT(cross(line, heading), 0.99f * length(line));
    float incoming_width_m = 0;
    for (int32_t i = light.lanes.begin; i < light.lanes.end; ++i) {
      const Lane& controlled = lane(map_->light_lanes[i]);
      if (controlled.in_junction) {
        EXPECT_EQ(controlled.junction, light.junction);
        const LanePoint begin = map_->lane_points[controlled.points.begin];
        EXPECT_LT(std::abs(dot(begin.position_m.xy() - light.stop_a_m.xy(), heading)), 0.1f);
      } else {
        incoming_width_m += map_->lane_points[static_cast<std::size_t>(controlled.points.end) - 1].width_m;
      }
    }
    EXPECT_GE(length(line), incoming_width_m - 0.01f);
    EXPECT_LT(length(light.head_m.xy() - light.stop_a_m.xy()), 70.0f);
  }
}

TEST_P(CarlaTowns, ACarOnItsLaneTouchesNoRoadEdge) {
  const DrivenLanes driven = drive_lanes(*map_);
  EXPECT_GT(driven.poses, 5000);
  EXPECT_EQ(driven.touching, 0);
}

/// The drivable surface, rebuilt as quads between the map's own lane points, for comparison with the edges.
class DrivableSurface {
 public:
  explicit DrivableSurface(const RoadMap& map) {
    std::vector<Aabb2> boxes;
    for (const Lane& lane : map.lanes) {
      if (!is_drivable(lane.type)) continue;
      const Span<const LanePoint> points = map.points_of(lane);
      for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const std::array<Vec3, 4> quad{border(points[i], 1), border(points[i], -1), border(points[i + 1], -1),
                                       border(points[i + 1], 1)};
        Aabb2 box{quad[0].xy(), quad[0].xy()};
        for (const Vec3 p : quad) {
          box.low = {min_of(box.low.x, p.x), min_of(box.low.y, p.y)};
          box.high = {max_of(box.high.x, p.x), max_of(box.high.y, p.y)};
        }
        quads_.push_back(quad);
        boxes.push_back(box);
        const float step_m = points[i + 1].s_m - points[i].s_m;
        if (std::abs(points[i + 1].width_m - points[i].width_m) > 0.1f * step_m)
          skewed_.push_back(points[i].position_m);
      }
    }
    grid_ = Grid(boxes, 5.0f);
  }

  bool covers(Vec3 p) const {
    const GridView grid = grid_.view();
    if (!grid.contains(p.xy())) return false;
    const std::size_t cell = static_cast<std::size_t>(grid.cell_y(p.y) * grid.num_x + grid.cell_x(p.x));
    for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
      const std::array<Vec3, 4>& quad = quads_[grid.items[i]];
      if (p.z < min_of(quad[0].z, quad[2].z) - 2.0f || p.z > max_of(quad[0].z, quad[2].z) + 2.0f) continue;
      bool inside = true;  // for a convex, counter-clockwise quad
      for (std::size_t k = 0; k < 4; ++k) {
        const Vec3 a = quad[k], b = quad[(k + 1) % 4];
        inside = inside && cross(b.xy() - a.xy(), p.xy() - a.xy()) >= 0;
      }
      if (inside) return true;
    }
    return false;
  }

  /// Whether a lane nearby changes its width so fast that its borders are not perpendicular to its heading.
  bool is_skewed_near(Vec3 p) const {
    for (const Vec3 position : skewed_) {
      if (length(position.xy() - p.xy()) < 12.0f) return true;
    }
    return false;
  }

  static Vec3 border(const LanePoint& point, float side) {
    const float half = 0.5f * side * point.width_m;
    return {point.position_m.x - half * std::sin(point.heading_rad),
            point.position_m.y + half * std::cos(point.heading_rad), point.position_m.z};
  }

 private:
  std::vector<std::array<Vec3, 4>> quads_;
  std::vector<Vec3> skewed_;
  Grid grid_;
};

bool segments_cross(Vec2 a, Vec2 b, const RoadEdge& edge) {
  const Vec2 p = b - a, e = edge.b_m.xy() - edge.a_m.xy(), to_edge = edge.a_m.xy() - a;
  const float det = cross(p, e);
  if (det == 0) return false;
  const float on_segment = cross(to_edge, e) / det, on_edge = cross(to_edge, p) / det;
  return on_segment >= 0 && on_segment <= 1 && on_edge >= -1e-3f && on_edge <= 1.001f;
}

TEST_P(CarlaTowns, EdgesAreExactlyWhereTheDrivableSurfaceEnds) {
  const DrivableSurface surface(*map_);
  const EdgeGrid edges(*map_);

  // Edges have the surface on their right and nothing on their left.
  int wrong_side = 0;
  for (const RoadEdge& edge : map_->road_edges) {
    const Vec3 along = edge.b_m - edge.a_m, middle = (edge.a_m + edge.b_m) * 0.5f;
    if (length(along) < 0.3f || surface.is_skewed_near(middle)) continue;
    const Vec2 left = left_normal(along.xy()) * (1.0f / length(along.xy()));
    auto left_of_middle = [&](float distance) {
      return Vec3{middle.x + distance * left.x, middle.y + distance * left.y, middle.z};
    };
    wrong_side += !surface.covers(left_of_middle(-0.06f)) || surface.covers(left_of_middle(0.06f)) ? 1 : 0;
  }
  // Diverging lanes leave a narrow gap; in Town06, some gaps are narrower than the probes' distance.
  EXPECT_LE(wrong_side, static_cast<int>(map_->road_edges.size()) / 500) << "of " << map_->road_edges.size();

  // A lane's border has an edge where nothing beyond it is drivable, and none where the surface continues.
  int borders = 0, missing = 0, across = 0;
  for (const Lane& border_lane : map_->lanes) {
    if (!is_drivable(border_lane.type)) continue;
    const Span<const LanePoint> points = map_->points_of(border_lane);
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
      if (points[i].width_m < 0.1f || surface.is_skewed_near(points[i].position_m)) continue;
      for (const float side : {1.0f, -1.0f}) {
        const Vec3 center = points[i].position_m, border = DrivableSurface::border(points[i], side);
        const Vec3 outward = (border - center) * (2.0f / points[i].width_m);
        bool all_in = true, none_in = true;
        for (int centimetres = -10; centimetres <= 30; ++centimetres) {
          const bool in = surface.covers(border + outward * (0.01f * static_cast<float>(centimetres)));
          all_in = all_in && in;
          none_in = none_in && (centimetres < 6 || !in);
        }
        const bool crossed = edges.any_near(border, 1.0f, [&](const RoadEdge& edge) {
          return segments_cross((border - outward * 0.1f).xy(), (border + outward * 0.25f).xy(), edge);
        });
        ++borders;
        missing += none_in && !crossed ? 1 : 0;
        across += all_in && crossed ? 1 : 0;
      }
    }
  }
  EXPECT_GT(borders, 1000);
  EXPECT_EQ(missing, 0) << "of " << borders;
  EXPECT_EQ(across, 0) << "of " << borders;
}

}  // namespace
}  // namespace pictura
