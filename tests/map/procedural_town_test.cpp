// Procedural towns: the text on its own, by an evaluation of lines, arcs and widths that shares no code with the writer
// or the importer, and then the town as the importer reads it.
#include "pictura/map/procedural/procedural_town.h"

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pugixml.hpp>

#include "pictura/common/error.h"
#include "pictura/common/grid.h"
#include "pictura/map/opendrive/opendrive.h"

namespace pictura {
namespace {

struct Size {
  int x, y;
};
constexpr Size kSizes[] = {{1, 1}, {1, 2}, {2, 1}, {2, 2}, {3, 3}, {5, 2}, {4, 4}, {1, 7}};

int expected_junctions(Size size) { return (size.x + 1) * (size.y + 1) - 4; }

// ---- the text on its own

struct Pose {
  double x, y, heading;
};

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * M_PI)); }

Pose evaluate(const pugi::xml_node& geometry, double ds) {
  const double x = geometry.attribute("x").as_double(), y = geometry.attribute("y").as_double();
  const double heading = geometry.attribute("hdg").as_double();
  const double k = geometry.child("arc").attribute("curvature").as_double(0);
  if (k == 0) return {x + ds * std::cos(heading), y + ds * std::sin(heading), heading};
  // About the centre of the circle.
  const double cx = x - std::sin(heading) / k, cy = y + std::cos(heading) / k;
  return {cx + std::sin(heading + k * ds) / k, cy - std::cos(heading + k * ds) / k, heading + k * ds};
}

class XmlTown {
 public:
  explicit XmlTown(const TownOptions& options) {
    const std::string text = procedural_town(options);
    EXPECT_TRUE(document_.load_buffer(text.data(), text.size()));
    root = document_.child("OpenDRIVE");
    for (const pugi::xml_node& road : root.children("road")) roads[road.attribute("id").as_int()] = road;
  }

  pugi::xml_node root;
  std::map<int, pugi::xml_node> roads;

 private:
  pugi::xml_document document_;
};

Pose end_of(const pugi::xml_node& road, bool at_start) {
  if (at_start) return evaluate(road.child("planView").first_child(), 0);
  const pugi::xml_node last = road.child("planView").last_child();
  return evaluate(last, last.attribute("length").as_double());
}

pugi::xml_node lane_of(const pugi::xml_node& road, int id) {
  const pugi::xml_node section = road.child("lanes").child("laneSection");
  for (const pugi::xml_node& lane : section.child(id > 0 ? "left" : "right").children("lane")) {
    if (lane.attribute("id").as_int() == id) return lane;
  }
  return {};
}

double width_at(const pugi::xml_node& lane, double s) {
  double width = 0;
  for (const pugi::xml_node& piece : lane.children("width")) {
    const double ds = s - piece.attribute("sOffset").as_double();
    if (ds < 0) break;
    width = piece.attribute("a").as_double() +
            ds * (piece.attribute("b").as_double() +
                  ds * (piece.attribute("c").as_double() + ds * piece.attribute("d").as_double()));
  }
  return width;
}

/// Inner and outer border of a lane at an end of its road, and the direction of +s there.
struct LaneEnd {
  double inner_x, inner_y, outer_x, outer_y, heading;
};

LaneEnd lane_end(const pugi::xml_node& road, int id, bool at_start) {
  const Pose pose = end_of(road, at_start);
  const double s = at_start ? 0 : road.attribute("length").as_double();
  const int side = id > 0 ? 1 : -1;
  double inner = 0;
  for (int i = side; i != id; i += side) inner += width_at(lane_of(road, i), s);
  const double outer = inner + width_at(lane_of(road, id), s);
  const double nx = -std::sin(pose.heading) * side, ny = std::cos(pose.heading) * side;
  return {pose.x + inner * nx, pose.y + inner * ny, pose.x + outer * nx, pose.y + outer * ny, pose.heading};
}

TEST(ProceduralTownText, PiecesMeetWithinAMicrometre) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    for (const Size size : kSizes) {
      const XmlTown town({seed, size.x, size.y});
      for (const auto& [id, road] : town.roads) {
        double s = 0;
        pugi::xml_node previous;
        for (const pugi::xml_node& geometry : road.child("planView").children("geometry")) {
          ASSERT_NEAR(geometry.attribute("s").as_double(), s, 1e-6);
          ASSERT_GT(geometry.attribute("length").as_double(), 1e-7);
          if (previous) {
            const Pose end = evaluate(previous, previous.attribute("length").as_double());
            const Pose start = evaluate(geometry, 0);
            ASSERT_LT(std::hypot(end.x - start.x, end.y - start.y), 1e-6) << "seed " << seed << " road " << id;
            ASSERT_LT(angle_between(end.heading, start.heading), 1e-6) << "seed " << seed << " road " << id;
          }
          s += geometry.attribute("length").as_double();
          previous = geometry;
        }
        ASSERT_NEAR(road.attribute("length").as_double(), s, 1e-6);
      }
    }
  }
}

TEST(ProceduralTownText, LinkedLanesMeetAndLinksAreMutual) {
  int links = 0;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    for (const Size size : kSizes) {
      const XmlTown town({seed, size.x, size.y});
      for (const auto& [id, road] : town.roads) {
        for (const char* direction : {"predecessor", "successor"}) {
          const bool at_start = std::string(direction) == "predecessor";
          const pugi::xml_node joint = road.child("link").child(direction);
          ASSERT_TRUE(joint) << "road " << id << " ends in nothing";
          if (std::string(joint.attribute("elementType").value()) != "road") continue;
          const pugi::xml_node other = town.roads.at(joint.attribute("elementId").as_int());
          const bool other_start = std::string(joint.attribute("contactPoint").value()) == "start";
          for (const char* side : {"left", "right"}) {
            for (const pugi::xml_node& lane : road.child("lanes").child("laneSection").child(side).children("lane")) {
              const pugi::xml_node link = lane.child("link").child(direction);
              const int lane_id = lane.attribute("id").as_int();
              if (std::string(lane.attribute("type").value()) == "parking") {
                ASSERT_FALSE(link);
                continue;
              }
              ASSERT_TRUE(link) << "seed " << seed << " road " << id << " lane " << lane_id << " " << direction;
              const int other_id = link.attribute("id").as_int();
              const pugi::xml_node other_lane = lane_of(other, other_id);
              ASSERT_TRUE(other_lane);
              ASSERT_STREQ(lane.attribute("type").value(), other_lane.attribute("type").value());
              const LaneEnd here = lane_end(road, lane_id, at_start), there = lane_end(other, other_id, other_start);
              ASSERT_LT(std::hypot(here.inner_x - there.inner_x, here.inner_y - there.inner_y), 1e-6)
                  << "seed " << seed << " road " << id << " lane " << lane_id << " " << direction;
              ASSERT_LT(std::hypot(here.outer_x - there.outer_x, here.outer_y - there.outer_y), 1e-6);
              // +s goes on where an end meets a start, and turns back otherwise.
              const double turn = at_start == other_start ? M_PI : 0;
              ASSERT_LT(angle_between(here.heading, there.heading + turn), 1e-6);
              ++links;
              if (road.attribute("junction").as_int() != -1) continue;
              const pugi::xml_node back = other_lane.child("link").child(other_start ? "predecessor" : "successor");
              ASSERT_EQ(back.attribute("id").as_int(), lane_id);
            }
          }
        }
      }
    }
  }
  EXPECT_GT(links, 10000);
}

TEST(ProceduralTownText, BordersOfLanesNeverFold) {
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const XmlTown town({seed, 4, 3});
    for (const auto& [id, road] : town.roads) {
      for (const pugi::xml_node& geometry : road.child("planView").children("geometry")) {
        const double k = geometry.child("arc").attribute("curvature").as_double(0);
        if (k == 0) continue;
        double widest = 0;  // of the side that the arc bends to
        for (int i = k > 0 ? 1 : -1; lane_of(road, i); i += k > 0 ? 1 : -1) {
          double most = 0;
          for (double s = 0; s <= road.attribute("length").as_double(); s += 1) {
            most = std::max(most, width_at(lane_of(road, i), s));
          }
          widest += most;
        }
        ASSERT_GT(1 / std::abs(k), widest + 0.2) << "seed " << seed << " road " << id;
      }
    }
  }
}

TEST(ProceduralTownText, EveryApproachHasOneLightOnePhaseAndAWayOnFromEveryLane) {
  int near_side = 0, far_side = 0;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    for (const Size size : kSizes) {
      const XmlTown town({seed, size.x, size.y});
      std::map<int, std::pair<int, std::string>> signals;  // id -> road and type
      std::map<int, int> signal_of_controller;
      for (const auto& [id, road] : town.roads) {
        for (const pugi::xml_node& signal : road.child("signals").children("signal")) {
          ASSERT_TRUE(
              signals.try_emplace(signal.attribute("id").as_int(), id, signal.attribute("type").value()).second);
          ++(road.attribute("junction").as_int() == -1 ? near_side : far_side);
          ASSERT_GE(signal.attribute("s").as_double(), 0);
          ASSERT_LE(signal.attribute("s").as_double(), road.attribute("length").as_double());
        }
      }
      for (const pugi::xml_node& controller : town.root.children("controller")) {
        signal_of_controller[controller.attribute("id").as_int()] =
            controller.child("control").attribute("signalId").as_int();
      }
      int junctions = 0;
      size_t lights = 0;
      for (const pugi::xml_node& junction : town.root.children("junction")) {
        ++junctions;
        std::map<std::pair<int, int>, int> ways_on;       // (incoming road, lane) -> connections
        std::map<int, std::set<int>> lights_of_approach;  // incoming road -> signals
        for (const pugi::xml_node& connection : junction.children("connection")) {
          const int incoming = connection.attribute("incomingRoad").as_int();
          const pugi::xml_node road = town.roads.at(connection.attribute("connectingRoad").as_int());
          ASSERT_EQ(road.attribute("junction").as_int(), junction.attribute("id").as_int());
          ASSERT_EQ(road.child("link").child("predecessor").attribute("elementId").as_int(), incoming);
          const bool from_start =
              std::string(road.child("link").child("predecessor").attribute("contactPoint").value()) == "start";
          // The incoming road says that it ends here.
          ASSERT_EQ(town.roads.at(incoming)
                        .child("link")
                        .child(from_start ? "predecessor" : "successor")
                        .attribute("elementId")
                        .as_int(),
                    junction.attribute("id").as_int());
          int driving = 0;
          for (const pugi::xml_node& link : connection.children("laneLink")) {
            const int from = link.attribute("from").as_int(), to = link.attribute("to").as_int();
            const pugi::xml_node lane = lane_of(road, to);
            ASSERT_EQ(lane.child("link").child("predecessor").attribute("id").as_int(), from);
            if (std::string(lane.attribute("type").value()) != "driving") continue;
            ++driving;
            ++ways_on[{incoming, from}];
            ASSERT_EQ(from > 0, from_start) << "traffic keeps to the right";
          }
          const pugi::xml_node reference = road.child("signals").child("signalReference");
          ASSERT_TRUE(reference);
          lights_of_approach[incoming].insert(reference.attribute("id").as_int());
          ASSERT_EQ(signals.at(reference.attribute("id").as_int()).second, "1000001");
          const pugi::xml_node validity = reference.child("validity");
          ASSERT_EQ(validity.attribute("fromLane").as_int(), -driving);
          ASSERT_EQ(validity.attribute("toLane").as_int(), -1);
        }
        std::set<int> controlled;
        int phase = 0;
        for (const pugi::xml_node& controller : junction.children("controller")) {
          ASSERT_EQ(controller.attribute("sequence").as_int(), phase++);
          controlled.insert(signal_of_controller.at(controller.attribute("id").as_int()));
        }
        std::set<int> referenced;
        for (const auto& [approach, of_approach] : lights_of_approach) {
          ASSERT_EQ(of_approach.size(), 1u);
          referenced.insert(*of_approach.begin());
          for (int lane = 1; lane <= 2; ++lane) {
            for (const int signed_lane : {lane, -lane}) {
              const pugi::xml_node node = lane_of(town.roads.at(approach), signed_lane);
              const bool incoming_side = ways_on.contains({approach, signed_lane > 0 ? 1 : -1});
              if (!incoming_side || std::string(node.attribute("type").value()) != "driving") continue;
              ASSERT_GE((ways_on[{approach, signed_lane}]), 1) << "seed " << seed << " road " << approach;
            }
          }
        }
        ASSERT_EQ(controlled, referenced);
        ASSERT_EQ(static_cast<int>(referenced.size()), phase);
        lights += referenced.size();
      }
      ASSERT_EQ(junctions, expected_junctions(size));
      ASSERT_EQ(lights, signals.size());
    }
  }
  EXPECT_GT(near_side, 100);
  EXPECT_GT(far_side, 100);
}

TEST(ProceduralTownText, EqualSeedsGiveEqualBytesAndOthersDiffer) {
  std::set<std::string> texts;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const std::string text = procedural_town({seed, 3, 2});
    EXPECT_EQ(text, procedural_town({seed, 3, 2}));
    texts.insert(text.substr(text.find("<road")));  // the header names the seed
  }
  EXPECT_EQ(texts.size(), 20u);
  EXPECT_NE(procedural_town({uint64_t{1} << 40, 2, 2}), procedural_town({0, 2, 2}));
}

TEST(ProceduralTownText, SeedsBringStraightsCurvesAvenuesParkingAndMissingStreets) {
  std::set<size_t> roads_of_seed;
  bool line = false, arc = false, avenue = false, parking = false, ring_without_avenue = false;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const XmlTown town({seed, 4, 4});
    size_t streets = 0;
    bool has_avenue = false;
    for (const auto& [id, road] : town.roads) {
      if (road.attribute("junction").as_int() != -1) continue;
      const std::string name = road.attribute("name").value();
      has_avenue = has_avenue || name.starts_with("Avenue");
      if (name.starts_with("Bend")) continue;
      ++streets;
      const double length = road.attribute("length").as_double();
      ASSERT_GT(length, 20);
      ASSERT_LT(length, 100);
      (road.child("planView").first_child().child("arc") ? arc : line) = true;
      for (const pugi::xml_node& lane : road.child("lanes").child("laneSection").child("right").children("lane")) {
        parking = parking || std::string(lane.attribute("type").value()) == "parking";
      }
    }
    (has_avenue ? avenue : ring_without_avenue) = true;
    roads_of_seed.insert(streets);
  }
  EXPECT_TRUE(line && arc && avenue && parking && ring_without_avenue);
  EXPECT_GT(roads_of_seed.size(), 1u);
}

TEST(ProceduralTownText, RefusesSizesOutOfRange) {
  for (const Size size : {Size{0, 3}, Size{3, 0}, Size{33, 1}, Size{1, 33}, Size{-1, 2}}) {
    EXPECT_THROW(procedural_town({0, size.x, size.y}), UsageError);
  }
  EXPECT_NO_THROW(procedural_town({0, 32, 1}));
}

// ---- the town as the importer reads it

RoadMap read_town(const TownOptions& options) { return parse_opendrive(procedural_town(options), "town"); }

bool segments_cross(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  const auto side = [](Vec2 p, Vec2 q, Vec2 r) { return cross(q - p, r - p); };
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

/// Road edges that may touch a box, by a grid.
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

  /// The first edge that crosses the segment, or -1.
  int crossing(Vec2 a, Vec2 b) const {
    const GridView grid = grid_.view();
    for (int iy = grid.cell_y(min_of(a.y, b.y)); iy <= grid.cell_y(max_of(a.y, b.y)); ++iy) {
      for (int ix = grid.cell_x(min_of(a.x, b.x)); ix <= grid.cell_x(max_of(a.x, b.x)); ++ix) {
        const auto cell = static_cast<size_t>(iy * grid.num_x + ix);
        for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
          const int32_t edge = grid.items[static_cast<size_t>(i)];
          const RoadEdge& e = map_.road_edges[static_cast<size_t>(edge)];
          if (segments_cross(a, b, e.a_m.xy(), e.b_m.xy())) return edge;
        }
      }
    }
    return -1;
  }

 private:
  const RoadMap& map_;
  Grid grid_;
};

Vec2 direction(float heading) { return {std::cos(heading), std::sin(heading)}; }

void check_town(const TownOptions& options) {
  SCOPED_TRACE(testing::Message() << "seed " << options.seed << ", " << options.blocks_x << "x" << options.blocks_y);
  const RoadMap map = read_town(options);
  ASSERT_NO_THROW(validate(map));
  const XmlTown town(options);
  const Size size{options.blocks_x, options.blocks_y};
  EXPECT_EQ(map.facts.roads, static_cast<int>(town.roads.size()));
  EXPECT_EQ(map.facts.junctions, expected_junctions(size));
  EXPECT_EQ(map.facts.signal_junctions, expected_junctions(size));
  size_t approaches = 0;
  for (const pugi::xml_node& junction : town.root.children("junction")) {
    for ([[maybe_unused]] const pugi::xml_node& controller : junction.children("controller")) ++approaches;
  }
  EXPECT_EQ(map.lights.size(), approaches);
  EXPECT_EQ(map.crosswalks.size(), approaches);
  EXPECT_EQ(map.facts.z_min_m, 0);
  EXPECT_EQ(map.facts.z_max_m, 0);

  const Edges edges(map);
  std::vector<int> driving;
  for (size_t i = 0; i < map.lanes.size(); ++i) {
    const Lane& lane = map.lanes[i];
    if (lane.type != LaneType::driving) continue;
    driving.push_back(static_cast<int>(i));
    EXPECT_TRUE(lane.is_endless) << "lane " << i;
    EXPECT_GE(lane.successors.size(), 1);
    EXPECT_GE(lane.predecessors.size(), 1);
    // A car in the middle of the lane touches no road edge.
    const Span<const LanePoint> points = map.points_of(lane);
    for (const LanePoint& point : points) {
      const Vec2 forward = direction(point.heading_rad) * 2.25f,
                 left = left_normal(direction(point.heading_rad)) * 1.0f;
      const Vec2 c = point.position_m.xy();
      const Vec2 corners[] = {c + forward + left, c - forward + left, c - forward - left, c + forward - left};
      for (size_t k = 0; k < 4; ++k) {
        ASSERT_EQ(edges.crossing(corners[k], corners[(k + 1) % 4]), -1) << "lane " << i << " at " << c.x << ", " << c.y;
      }
    }
    // Nothing stands along its middle, and its two mouths are open.
    for (size_t k = 1; k < points.size(); ++k) {
      ASSERT_EQ(edges.crossing(points[k - 1].position_m.xy(), points[k].position_m.xy()), -1);
    }
    for (const LanePoint& point : {points[0], points[points.size() - 1]}) {
      const Vec2 across = left_normal(direction(point.heading_rad)) * (0.5f * point.width_m - 0.1f);
      ASSERT_EQ(edges.crossing(point.position_m.xy() - across, point.position_m.xy() + across), -1) << "lane " << i;
    }
  }

  for (const TrafficLight& light : map.lights) {
    ASSERT_GE(light.lanes.size(), 2);
    const Vec2 stop = (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f;
    EXPECT_NEAR(length(light.stop_b_m.xy() - light.stop_a_m.xy()), 3.5f, 3.6f);
    EXPECT_LT(dot(light.head_facing, direction(light.stop_heading_rad)), -0.9f);
    // The head stands to the right of its traffic, near the line, or across the junction on the street that goes on,
    // which bends by at most 30 degrees: its chord leaves by 15.
    const Vec2 to_head = light.head_m.xy() - stop;
    const float ahead_m = dot(direction(light.stop_heading_rad), to_head);
    EXPECT_LT(cross(direction(light.stop_heading_rad), to_head), 0.28f * max_of(0.0f, ahead_m));
    EXPECT_LT(length(to_head), 50.0f);
    bool incoming = false, connecting = false;
    for (int32_t k = light.lanes.begin; k < light.lanes.end; ++k) {
      const Lane& lane = map.lanes[static_cast<size_t>(map.light_lanes[static_cast<size_t>(k)])];
      (lane.in_junction ? connecting : incoming) = true;
      if (lane.in_junction) continue;
      const LanePoint& last = map.points_of(lane)[map.points_of(lane).size() - 1];
      EXPECT_LT(length(last.position_m.xy() - stop), 4.0f);
    }
    EXPECT_TRUE(incoming && connecting);
  }

  // Whoever drives somewhere can get to any driving lane; a ring without junctions has two directions of travel.
  if (expected_junctions(size) == 0) return;
  std::set<int> seen{driving[0]};
  std::vector<int> stack{driving[0]};
  while (!stack.empty()) {
    const Lane& lane = map.lanes[static_cast<size_t>(stack.back())];
    stack.pop_back();
    std::vector<int> next(map.links(lane.successors).begin(), map.links(lane.successors).end());
    if (lane.left_neighbor >= 0) next.push_back(lane.left_neighbor);
    if (lane.right_neighbor >= 0) next.push_back(lane.right_neighbor);
    for (const int other : next) {
      if (map.lanes[static_cast<size_t>(other)].type == LaneType::driving && seen.insert(other).second)
        stack.push_back(other);
    }
  }
  EXPECT_EQ(seen.size(), driving.size());
}

TEST(ProceduralTownMap, SmallTownsAreSound) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    for (const Size size : {Size{1, 1}, Size{1, 2}, Size{2, 2}, Size{3, 1}, Size{3, 3}}) {
      check_town({seed, size.x, size.y});
      if (HasFatalFailure()) return;
    }
  }
}

TEST(ProceduralTownMap, LargeTownsAreSound) {
  for (uint64_t seed = 100; seed < 102; ++seed) {
    for (const Size size : {Size{5, 4}, Size{8, 8}}) {
      check_town({seed, size.x, size.y});
      if (HasFatalFailure()) return;
    }
  }
}

TEST(ProceduralTownMap, AvenuesAllowLaneChanges) {
  bool found = false;
  for (uint64_t seed = 0; seed < 6 && !found; ++seed) {
    const RoadMap map = read_town({seed, 2, 2});
    for (size_t i = 0; i < map.lanes.size(); ++i) {
      const Lane& lane = map.lanes[i];
      if (lane.type != LaneType::driving || lane.right_neighbor < 0) continue;
      const Lane& right = map.lanes[static_cast<size_t>(lane.right_neighbor)];
      EXPECT_EQ(right.left_neighbor, static_cast<int>(i));
      const Vec2 to_right = map.points_of(right)[0].position_m.xy() - map.points_of(lane)[0].position_m.xy();
      EXPECT_NEAR(length(to_right), 3.5f, 1e-3f);
      EXPECT_LT(cross(direction(map.points_of(lane)[0].heading_rad), to_right), 0);
      found = true;
    }
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace pictura
