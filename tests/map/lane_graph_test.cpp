// Routes, distances, reachability and components of lanes: on a hand-made map, on random maps compared with brute
// force, and on towns.
#include "pictura/map/lane_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/map/load_map.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::size_t at(int32_t index) { return static_cast<std::size_t>(index); }

/// Lanes of the given lengths without links; LaneGraph uses nothing else.
RoadMap lanes_of(const std::vector<float>& lengths_m) {
  RoadMap map;
  map.lanes.resize(lengths_m.size());
  for (std::size_t i = 0; i < lengths_m.size(); ++i) map.lanes[i].length_m = lengths_m[i];
  return map;
}

void set_successors(const std::vector<std::vector<int32_t>>& successors, RoadMap* map) {
  for (std::size_t i = 0; i < successors.size(); ++i) {
    map->lanes[i].successors.begin = static_cast<int32_t>(map->lane_links.size());
    map->lane_links.insert(map->lane_links.end(), successors[i].begin(), successors[i].end());
    map->lanes[i].successors.end = static_cast<int32_t>(map->lane_links.size());
  }
}

void set_side_by_side(int32_t left, int32_t right, RoadMap* map) {
  map->lanes[at(left)].right_neighbor = right;
  map->lanes[at(right)].left_neighbor = left;
}

/// A ring 0 -> 1 -> 2 -> 0 of 100 m lanes; lane 3 is on the right of lane 1 and leads to an exit, lane 4.
RoadMap ring() {
  RoadMap map = lanes_of({100, 100, 100, 80, 50});
  set_successors({{1}, {2}, {0}, {4}, {}}, &map);
  set_side_by_side(1, 3, &map);
  return map;
}

TEST(LaneGraph, RoutesAlongOneLaneAndAroundALoop) {
  const RoadMap map = ring();
  const LaneGraph graph(map, 10);
  const LaneRoute ahead = graph.route({0, 20}, {0, 70}).value();
  EXPECT_THAT(ahead.lanes, ElementsAre(0));
  EXPECT_NEAR(ahead.length_m, 50, 1e-5);
  EXPECT_EQ(graph.route({0, 20}, {0, 20})->length_m, 0);
  const LaneRoute behind = graph.route({0, 70}, {0, 20}).value();
  EXPECT_THAT(behind.lanes, ElementsAre(0, 1, 2, 0));
  EXPECT_NEAR(behind.length_m, 30 + 200 + 20, 1e-5);
  EXPECT_EQ(behind.lane_changes, 0);
  EXPECT_EQ(behind.cost_m, behind.length_m);
}

TEST(LaneGraph, LaneChangesKeepTheFractionOfTheLane) {
  const RoadMap map = ring();
  const LaneGraph graph(map, 10);
  const LaneRoute exit = graph.route({0, 40}, {4, 5}).value();
  EXPECT_THAT(exit.lanes, ElementsAre(0, 1, 3, 4));
  EXPECT_NEAR(exit.length_m, 60 + 80 + 5, 1e-5);
  EXPECT_EQ(exit.lane_changes, 1);
  EXPECT_NEAR(exit.cost_m, exit.length_m + 10, 1e-5);
  // Half of lane 1 is half of lane 3.
  const LaneRoute adjacent = graph.route({1, 50}, {3, 60}).value();
  EXPECT_THAT(adjacent.lanes, ElementsAre(1, 3));
  EXPECT_NEAR(adjacent.length_m, 20, 1e-5);
  EXPECT_NEAR(graph.route({1, 50}, {3, 40})->cost_m, 10, 1e-5);
  const LaneRoute behind = graph.route({1, 50}, {3, 39}).value();
  EXPECT_THAT(behind.lanes, ElementsAre(1, 2, 0, 1, 3));
  EXPECT_NEAR(behind.length_m, 50 + 200 + 39, 1e-4);
  EXPECT_FALSE(graph.route({4, 0}, {0, 0}).has_value());
}

TEST(LaneGraph, DistancesReachabilityAndComponentsOfTheRing) {
  const RoadMap map = ring();
  const LaneGraph graph(map, 10);
  EXPECT_THAT(graph.distances_from({0, 0}), ElementsAre(0, 100, 200, 110, 190));
  EXPECT_THAT(graph.distances_from({0, 25}), ElementsAre(275, 75, 175, 85, 165));
  EXPECT_THAT(graph.distances_from({4, 0}), ElementsAre(kInfinite, kInfinite, kInfinite, kInfinite, 0));
  EXPECT_THAT(graph.reachable_from(0), ElementsAre(true, true, true, true, true));
  EXPECT_THAT(graph.reachable_from(4), ElementsAre(false, false, false, false, true));
  const LaneComponents components = graph.components();
  EXPECT_EQ(components.count, 2);
  EXPECT_THAT(components.of_lane, ElementsAre(1, 1, 1, 1, 0));
}

TEST(LaneGraph, RejectsInvalidPositions) {
  const RoadMap map = ring();
  const LaneGraph graph(map);
  const auto message_of = [&](LanePosition from, LanePosition to) -> std::string {
    return test::message_of([&] { graph.route(from, to); });
  };
  EXPECT_THAT(message_of({5, 0}, {0, 0}), HasSubstr("[0, 5), got 5"));
  EXPECT_THAT(message_of({0, 0}, {-1, 0}), HasSubstr("[0, 5), got -1"));
  EXPECT_THAT(message_of({0, 0}, {3, 80.5f}), HasSubstr("[0, 80] m on lane 3, got 80.5"));
  EXPECT_THAT(message_of({0, std::nanf("")}, {3, 0}), HasSubstr("got nan"));
  EXPECT_THROW(graph.distances_from({0, -1}), Error);
  EXPECT_THROW(graph.reachable_from(9), Error);
  EXPECT_THROW(LaneGraph(map, -1), Error);
  EXPECT_THROW(LaneGraph(map, std::nan("")), Error);
  EXPECT_THROW(LaneGraph(map, kInfinite), Error);
}

/// Rows of one to four adjacent lanes of equal length, linked at random.
RoadMap random_map(std::mt19937* random) {
  const auto below = [&](uint32_t count) { return static_cast<int32_t>((*random)() % count); };
  std::vector<float> lengths;
  std::vector<int> row_of;
  for (int row = 0; row < 8; ++row) {
    const int lanes = 1 + below(4);
    const auto length_m = static_cast<float>(1 + below(100));
    for (int i = 0; i < lanes; ++i) {
      lengths.push_back(length_m);
      row_of.push_back(row);
    }
  }
  RoadMap map = lanes_of(lengths);
  const auto count = static_cast<int32_t>(lengths.size());
  for (int32_t lane = 1; lane < count; ++lane) {
    if (row_of[at(lane)] == row_of[at(lane - 1)] && below(4)) set_side_by_side(lane - 1, lane, &map);
  }
  std::vector<std::vector<int32_t>> successors(lengths.size());
  for (int32_t lane = 0; lane < count; ++lane) {
    for (int32_t i = below(3); i > 0; --i) {
      const int32_t next = below(static_cast<uint32_t>(count));
      // A loop is allowed; a successor adjacent to its own lane would be a lane change.
      if (next == lane || row_of[at(next)] != row_of[at(lane)]) successors[at(lane)].push_back(next);
    }
  }
  set_successors(successors, &map);
  return map;
}

/// Minimum costs between positions at the given fractions of all lanes, by the Floyd-Warshall algorithm, with lane
/// changes allowed at each position. Node index: fraction_index * lanes + lane; the first fraction is 0.
std::vector<std::vector<double>> all_distances(const RoadMap& map, const std::vector<double>& fractions,
                                               double change_cost_m) {
  const std::size_t lanes = map.lanes.size(), nodes = fractions.size() * lanes;
  std::vector<std::vector<double>> distance(nodes, std::vector<double>(nodes, kInfinite));
  const auto relax = [&](std::size_t from, std::size_t to, double cost) {
    distance[from][to] = std::min(distance[from][to], cost);
  };
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const Lane& each = map.lanes[lane];
    for (std::size_t k = 0; k < fractions.size(); ++k) {
      const std::size_t node = k * lanes + lane;
      relax(node, node, 0);
      for (std::size_t later = k + 1; later < fractions.size(); ++later) {
        relax(node, later * lanes + lane, (fractions[later] - fractions[k]) * each.length_m);
      }
      for (const int32_t next : map.links(each.successors)) relax(node, at(next), (1 - fractions[k]) * each.length_m);
      for (const int32_t neighbor : {each.left_neighbor, each.right_neighbor}) {
        if (neighbor >= 0) relax(node, k * lanes + at(neighbor), change_cost_m);
      }
    }
  }
  for (std::size_t via = 0; via < nodes; ++via) {
    for (std::size_t from = 0; from < nodes; ++from) {
      for (std::size_t to = 0; to < nodes; ++to) relax(from, to, distance[from][via] + distance[via][to]);
    }
  }
  return distance;
}

/// Follows the route from lane to lane and adds up its cost.
void expect_drivable(const RoadMap& map, const LaneRoute& route, LanePosition from, LanePosition to,
                     double change_cost_m) {
  ASSERT_EQ(route.lanes.front(), from.lane);
  ASSERT_EQ(route.lanes.back(), to.lane);
  double fraction = double{from.s_m} / map.lanes[at(from.lane)].length_m, length_m = 0;
  int32_t changes = 0;
  for (std::size_t i = 0; i + 1 < route.lanes.size(); ++i) {
    const Lane& lane = map.lanes[at(route.lanes[i])];
    const int32_t next = route.lanes[i + 1];
    if (next == lane.left_neighbor || next == lane.right_neighbor) {
      ++changes;
      continue;
    }
    const Span<const int32_t> links = map.links(lane.successors);
    ASSERT_NE(std::find(links.begin(), links.end(), next), links.end()) << route.lanes[i] << " to " << next;
    length_m += (1 - fraction) * lane.length_m;
    fraction = 0;
  }
  length_m += to.s_m - fraction * map.lanes[at(to.lane)].length_m;
  EXPECT_NEAR(route.length_m, length_m, 1e-3);
  EXPECT_EQ(route.lane_changes, changes);
  EXPECT_NEAR(route.cost_m, length_m + change_cost_m * changes, 1e-3);
}

TEST(LaneGraph, AgreesWithBruteForceOnRandomMaps) {
  std::mt19937 random(7);
  int routes = 0, unreachable = 0, with_changes = 0, on_one_lane = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const RoadMap map = random_map(&random);
    const auto lanes = static_cast<uint32_t>(map.lanes.size());
    const double change_cost_m = 0.5 + static_cast<double>(random() % 40);
    const std::vector<double> fractions{0, 0.25, 0.75};
    const std::vector<std::vector<double>> expected = all_distances(map, fractions, change_cost_m);
    const LaneGraph graph(map, change_cost_m);
    const auto node_of = [&](LanePosition position) {
      const double fraction = position.s_m / map.lanes[at(position.lane)].length_m;
      return static_cast<std::size_t>(std::lround(fraction * 4) + 1) / 2 * lanes + at(position.lane);
    };
    for (int query = 0; query < 100; ++query) {
      const auto random_position = [&] {
        const auto lane = static_cast<int32_t>(random() % lanes);
        return LanePosition{lane,
                            static_cast<float>(fractions[random() % fractions.size()]) * map.lanes[at(lane)].length_m};
      };
      const LanePosition from = random_position(), to = random_position();
      const double expected_cost_m = expected[node_of(from)][node_of(to)];
      const std::optional<LaneRoute> route = graph.route(from, to);
      ASSERT_EQ(route.has_value(), expected_cost_m < kInfinite);
      const std::vector<double> distances = graph.distances_from(from);
      for (uint32_t lane = 0; lane < lanes; ++lane) {
        if (distances[lane] < kInfinite || expected[node_of(from)][lane] < kInfinite) {
          ASSERT_NEAR(distances[lane], expected[node_of(from)][lane], 1e-3);
        }
      }
      if (!route) {
        ++unreachable;
        continue;
      }
      ++routes;
      with_changes += route->lane_changes > 0;
      on_one_lane += route->lanes.size() == 1;
      ASSERT_NEAR(route->cost_m, expected_cost_m, 1e-3);
      expect_drivable(map, *route, from, to, change_cost_m);
    }
    const LaneComponents components = graph.components();
    const std::set<int32_t> numbers(components.of_lane.begin(), components.of_lane.end());
    EXPECT_EQ(static_cast<int32_t>(numbers.size()), components.count);
    for (uint32_t a = 0; a < lanes; ++a) {
      const std::vector<bool> reachable = graph.reachable_from(static_cast<int32_t>(a));
      for (uint32_t b = 0; b < lanes; ++b) {
        EXPECT_EQ(reachable[b], expected[a][b] < kInfinite);
        const bool mutual = expected[a][b] < kInfinite && expected[b][a] < kInfinite;
        ASSERT_EQ(components.of_lane[a] == components.of_lane[b], mutual) << a << " and " << b;
        EXPECT_TRUE(!reachable[b] || components.of_lane[a] >= components.of_lane[b]);
      }
    }
  }
  // The maps are neither fully connected nor fully disconnected.
  EXPECT_GT(routes, 1000);
  EXPECT_GT(unreachable, 500);
  EXPECT_GT(with_changes, 500);
  EXPECT_GT(on_one_lane, 50);
}

/// The components of the endless driving lanes.
std::set<int32_t> endless_components(const RoadMap& map, const LaneComponents& components) {
  std::set<int32_t> found;
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (map.lanes[i].type == LaneType::driving && map.lanes[i].is_endless) found.insert(components.of_lane[i]);
  }
  return found;
}

TEST(LaneGraph, ProceduralTownsHaveOneComponent) {
  for (const char* name : {"procedural:1", "procedural:8", "city:1"}) {
    const std::shared_ptr<const RoadMap> map = load_map(name);
    const LaneGraph graph(*map, 20);
    EXPECT_EQ(endless_components(*map, graph.components()).size(), 1u) << name;
    std::mt19937 random(3);
    for (int i = 0; i < 50; ++i) {
      const auto random_position = [&] {
        int32_t lane = 0;
        do lane = static_cast<int32_t>(random() % map->lanes.size());
        while (map->lanes[at(lane)].type != LaneType::driving);
        return LanePosition{lane, 0.3f * map->lanes[at(lane)].length_m};
      };
      const LanePosition from = random_position(), to = random_position();
      const std::optional<LaneRoute> route = graph.route(from, to);
      ASSERT_TRUE(route.has_value()) << name << ": " << from.lane << " to " << to.lane;
      expect_drivable(*map, *route, from, to, 20);
    }
  }
}

TEST(LaneGraph, CarlaTowns) {
  const std::vector<std::string> towns = known_towns();
  if (towns.empty()) GTEST_SKIP() << "no .xodr files in " << map_folder() << " (set PICTURA_DATA)";
  fmt::print("{:10} {:>14} {:>15} {:>10}\n", "town", "driving lanes", "endless lanes", "components");
  for (const std::string& town : towns) {
    const std::shared_ptr<const RoadMap> map = load_map(town);
    const LaneGraph graph(*map);
    const LaneComponents components = graph.components();
    const auto is_driving = [](const Lane& lane) { return lane.type == LaneType::driving; };
    const auto is_endless = [&](const Lane& lane) { return is_driving(lane) && lane.is_endless; };
    const auto driving = std::count_if(map->lanes.begin(), map->lanes.end(), is_driving);
    const auto endless = std::count_if(map->lanes.begin(), map->lanes.end(), is_endless);
    fmt::print("{:10} {:14} {:15} {:10}\n", town, driving, endless, endless_components(*map, components).size());
    EXPECT_EQ(endless, driving) << town;
    EXPECT_EQ(endless_components(*map, components).size(), 1u) << town;
  }
}

}  // namespace
}  // namespace pictura
