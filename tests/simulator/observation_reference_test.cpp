// Every observed number, in random worlds of all maps, compared with observation_reference.h. Both implementations read
// pieces of lines; the tests also compare these pieces with the road map.
#include "pictura/tests/simulator/observation_reference.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/simulator/cpu_simulator.h"
#include "pictura/tests/simulator/random_edit.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/named_maps.h"
#include "pictura/tests/support/recorded_crossing.h"

namespace pictura::testing {
namespace {

/// Allowed difference of scaled numbers. The simulator computes in float: a difference of coordinates, a direction
/// and a product each have a relative error of up to 1e-7.
constexpr double kTolerance = 2e-6;
/// Tolerance of distances. Rows this close to the border of a range may be observed or not. Rows whose distances
/// differ by less may come in either order, since the document does not specify the order of equal distances.
constexpr double kTie_m = 1e-3;

bool is_near(float observed, double expected) { return std::abs(observed - expected) <= kTolerance; }

/// Returns the first number that differs by more than the tolerance; empty if none does.
std::string difference(const char* name, Span<const float> observed, const std::vector<double>& expected) {
  if (observed.size() != expected.size()) return fmt::format("{} has {} numbers", name, observed.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    if (!is_near(observed[i], expected[i])) {
      return fmt::format("{}[{}] is {}, expected {}", name, i, observed[i], expected[i]);
    }
  }
  return "";
}

/// Returns a set's first fault: a row without a counterpart in the reference, a wrong choice or order of rows, or
/// nonzero padding. Empty if there is none. Rows may be missing unless `is_whole`.
std::string difference_of_set(const char* name, Span<const float> observed, int max_rows, int count,
                              const std::vector<ReferenceRow>& reference, bool is_whole) {
  if (count < 0 || count > max_rows) return fmt::format("{} has {} rows", name, count);
  const size_t features = observed.size() / static_cast<size_t>(max_rows);
  std::vector<uint8_t> is_observed(reference.size());
  double last_m = 0;
  for (int row = 0; row < count; ++row) {
    const float* numbers = observed.data() + static_cast<size_t>(row) * features;
    size_t found = 0;
    while (
        found < reference.size() &&
        (is_observed[found] || !std::equal(numbers, numbers + features, reference[found].features.begin(), is_near))) {
      ++found;
    }
    const std::string where = fmt::format("{}, row {} of {}, ", name, row, count);
    if (found == reference.size()) return where + "is nothing of this world";
    is_observed[found] = 1;
    if (reference[found].inside_m < -kTie_m) return where + "is out of range";
    if (reference[found].distance_m < last_m - kTie_m) return where + "is nearer than a row before it";
    last_m = std::max(last_m, reference[found].distance_m);
  }
  for (size_t i = 0; i < reference.size() && is_whole; ++i) {
    if (is_observed[i] || reference[i].inside_m < kTie_m) continue;
    if (count < max_rows || reference[i].distance_m < last_m - kTie_m) {
      return fmt::format("{} lacks what is in range at {} m", name, reference[i].distance_m);
    }
  }
  const auto is_zero = [](float number) { return number == 0; };
  const bool is_padded = std::all_of(observed.begin() + static_cast<size_t>(count) * features, observed.end(), is_zero);
  return is_padded ? "" : fmt::format("{} is not padded with zeros", name);
}

/// Counts of compared cases. Tests use them to check that the cases occurred.
struct Compared {
  int observations = 0, last_ones = 0, zeros = 0, without_lane = 0, far_from_lanes = 0, beyond_cells = 0;
  std::array<int, 3> of_class{};
  std::array<int, kNumEntitySets> filled{}, full{};
};

/// Compares the observations of all slots with the reference. `ended` [slots]: nonzero where an infraction ended the
/// agent's episode in the last step.
void compare(Simulator& simulator, Span<const uint8_t> ended, Compared* compared) {
  const ObservationView all = simulator.observations();
  const AgentStateView state = simulator.state();
  for (int slot = 0; slot < simulator.num_slots(); ++slot) {
    SCOPED_TRACE(fmt::format("slot {}, step {}", slot, simulator.episode_step()[0]));
    // The slot's part of an array; empty where the array is not computed.
    const auto of_slot = [&](const auto& array) {
      const size_t size = array.size() / static_cast<size_t>(simulator.num_slots());
      return array.subspan(static_cast<size_t>(slot) * size, size);
    };
    const bool goes_on = takes_actions(state.status[slot]);
    if (!goes_on && ended[slot] == 0 && state.left[slot] == 0) {
      ++compared->zeros;
#define X(name, type, rows, features, part, comment) \
  for (const type number : of_slot(all.name)) ASSERT_EQ(number, 0) << #name;
      PICTURA_OBSERVATION_ARRAYS(X)
#undef X
      continue;
    }
    const ReferenceObservation expected = reference_observation(simulator, slot);
    ASSERT_EQ(difference("ego", of_slot(all.ego), expected.ego), "");
    ASSERT_EQ(difference("conditioning", of_slot(all.conditioning), expected.conditioning), "");
    ASSERT_EQ(difference("waypoints", of_slot(all.waypoints), expected.waypoints), "");
    const auto compare_set = [&](EntitySet set, const char* name, const Span<float>& rows,
                                 int max_rows) -> std::string {
      const auto index = static_cast<size_t>(set);
      const int count = all.set_counts.empty() ? 0 : of_slot(all.set_counts)[index];
      compared->filled[index] += count > 0;
      compared->full[index] += count == max_rows;
      if (rows.empty()) return count == 0 ? "" : "rows of what is not observed";
      const bool is_whole = expected.is_within_cells || set == EntitySet::partners;
      return difference_of_set(name, of_slot(rows), max_rows, count, expected.sets[index], is_whole);
    };
    ASSERT_EQ(compare_set(EntitySet::partners, "partners", all.partners, kMaxPartners), "");
    ASSERT_EQ(compare_set(EntitySet::lanes, "lanes", all.lanes, kMaxLanes), "");
    ASSERT_EQ(compare_set(EntitySet::boundaries, "boundaries", all.boundaries, kMaxBoundaries), "");
    ASSERT_EQ(compare_set(EntitySet::controls, "controls", all.controls, kMaxControls), "");
    ASSERT_EQ(compare_set(EntitySet::walls, "walls", all.walls, kMaxWalls), "");
    ++compared->observations;
    compared->last_ones += !goes_on;
    compared->without_lane += state.lane[slot] < 0;
    compared->far_from_lanes += !expected.is_near_lane;
    compared->beyond_cells += !expected.is_within_cells;
    ++compared->of_class[static_cast<int>(state.agent_class[slot])];
  }
}

/// Drives worlds by mixed actions and edits them every few steps. Compares before and after each edit, and once more
/// one step later, when many agents end.
void drive_and_compare(Simulator& simulator, int steps, Compared* compared) {
  constexpr int kEvery = 5;
  std::vector<uint8_t> ended(static_cast<size_t>(simulator.num_slots()));
  compare(simulator, ended, compared);
  for (int step = 1; step <= steps && !::testing::Test::HasFatalFailure(); ++step) {
    simulator.step(mixed_actions(simulator.num_slots(), static_cast<uint32_t>(step)));
    if (step % kEvery > 1) continue;
    const AgentStateView state = simulator.state();
    for (size_t slot = 0; slot < ended.size(); ++slot) ended[slot] = (state.events[slot] & kInfractions) != 0;
    compare(simulator, ended, compared);
    if (step % kEvery != 0) continue;
    const RandomEdit edit(state, simulator.num_slots(), static_cast<uint32_t>(step));
    simulator.set_state(edit.slots(), edit.fields());
    compare(simulator, ended, compared);  // edits keep the step's events and thus the last observations
  }
}

SimulatorConfig mixed_traffic() {
  SimulatorConfig config;
  config.num_threads = 1;
  config.seed = 3;
  config.pedestrian_fraction = config.cyclist_fraction = 0.35f;
  config.parked_cars = 16;
  config.wall_observations = true;
  return config;
}

class ObservationOfMap : public ::testing::TestWithParam<const char*> {};

TEST_P(ObservationOfMap, MatchesTheReference) {
  if (const std::string reason = test::missing(GetParam()); !reason.empty()) GTEST_SKIP() << reason;
  const auto simulator = make(mixed_traffic(), load_map(GetParam()), {{0, 24, 0}});
  Compared compared;
  drive_and_compare(*simulator, 11, &compared);
  EXPECT_GT(compared.observations, 100);
  EXPECT_GT(compared.zeros, 3);
  for (const int observations : compared.of_class) EXPECT_GT(observations, 10);
  for (const int observations : compared.filled) EXPECT_GT(observations, 10);
}

INSTANTIATE_TEST_SUITE_P(Maps, ObservationOfMap,
                         ::testing::Values("Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07",
                                           "Town10HD", "Town03#2", "procedural:1", "procedural:2", "procedural:3"),
                         test::map_name);

TEST(ObservationReference, HoldsForEveryConfiguration) {
  const auto town = load_map("procedural:2:blocks=2x2");
  const auto compare_with = [&town](const auto& change) {
    SimulatorConfig config = mixed_traffic();
    change(&config);
    const auto simulator = make(config, town, {{0, 12, 0}, {0, 20, 1}});
    Compared compared;
    drive_and_compare(*simulator, 16, &compared);
    return compared;
  };
  compare_with([](SimulatorConfig* config) { config->auxiliary_observations = false; });
  compare_with([](SimulatorConfig* config) { config->wall_observations = false; });
  compare_with([](SimulatorConfig* config) { config->walls = false; });
  compare_with([](SimulatorConfig* config) { config->vector_observations = false; });
  compare_with([](SimulatorConfig* config) { config->light_cycles = LightCycles::independent; });
  compare_with([](SimulatorConfig* config) {
    for (ConditioningRange& range : config->conditioning) range = {0.5f * range.low, 2 * range.high, range.mixture};
  });
  const Compared left = compare_with([](SimulatorConfig* config) {
    config->after_infraction = AfterInfraction::leave;
    config->reset_inactive_fraction = 2;
  });
  EXPECT_GT(left.last_ones, 0);
  const Compared driven_on =
      compare_with([](SimulatorConfig* config) { config->after_infraction = AfterInfraction::drive_on; });
  EXPECT_GT(driven_on.observations, left.observations);
}

TEST(ObservationReference, HoldsInCrowds) {
  SimulatorConfig config = mixed_traffic();
  config.parked_cars = 60;
  const auto simulator = make(config, load_map("procedural:2:blocks=2x2"), {{0, 120, 0}});
  Compared compared;
  drive_and_compare(*simulator, 1, &compared);
  EXPECT_EQ(compared.full[static_cast<size_t>(EntitySet::partners)], compared.observations);
}

TEST(ObservationReference, ALeavingAgentObservesNothing) {
  SimulatorConfig config = mixed_traffic();
  config.leave_at_goal = true;
  const auto simulator = make(config, load_map("procedural:2:blocks=2x2"), {{0, 12, 0}});
  const AgentStateView state = simulator->state();
  std::vector<int32_t> slots;
  std::vector<float> x_m, y_m, z_m;
  for (int slot = 0; slot < simulator->num_slots(); slot += 2) {
    slots.push_back(slot);
    x_m.push_back(state.x_m[slot]);
    y_m.push_back(state.y_m[slot]);
    z_m.push_back(state.z_m[slot]);
  }
  const std::vector<uint8_t> is_open(slots.size(), 1);
  simulator->set_state(
      Array(slots),
      std::vector<NamedArray>{
          {"goal_x_m", Array(x_m)}, {"goal_y_m", Array(y_m)}, {"goal_z_m", Array(z_m)}, {"goal_open", Array(is_open)}});
  const StepResult result = simulator->step(mixed_actions(simulator->num_slots(), 0));
  std::vector<uint8_t> nobody(static_cast<size_t>(simulator->num_slots()));
  for (const int32_t slot : slots) EXPECT_EQ(result.terminated[slot], 1);
  Compared compared;
  compare(*simulator, nobody, &compared);
  EXPECT_EQ(compared.zeros, 6);
}

TEST(ObservationReference, HoldsOnOpenRoads) {
  SimulatorConfig config = cars({.num_threads = 1, .reset_inactive_fraction = 2});
  const auto simulator =
      make(config, std::make_shared<RoadMap>(parse_opendrive(test::open_street(), "street.xodr")), {{0, 12, 0}});
  const std::vector<uint8_t> nobody(static_cast<size_t>(simulator->num_slots()));
  Compared compared;
  for (int step = 0; step < 300 && !HasFatalFailure(); ++step) {
    const StepResult result = simulator->step(straight_actions(simulator->state(), simulator->num_slots()));
    const Span<const uint8_t> left(simulator->state().left, static_cast<size_t>(simulator->num_slots()));
    if (std::count(left.begin(), left.end(), 1) > 0) compare(*simulator, result.terminated, &compared);
  }
  EXPECT_GT(compared.last_ones, 3);
  EXPECT_GT(compared.zeros, 3);
}

/// Lines, and the scaled width or height of the pieces that they are cut into.
struct Lines {
  std::vector<std::vector<Vec3>> points;
  std::vector<double> extents;
};

/// Limits of pieces: their distance from the line, their length, and whether they end only at the line's points.
struct PieceLimits {
  double chord_error_m, longest_m;
  bool ends_at_points;
};
constexpr PieceLimits kTrainingPieces{0.25, 10, true}, kEvenPieces{0.02, 5, false};

/// Returns the maximum distance of points [begin, end] of a line from the chord between the first and last points.
double furthest_aside_m(const std::vector<Vec3>& points, size_t begin, size_t end) {
  const Vec2 first = points[begin].xy(), way = points[end].xy() - first;
  double furthest_m = 0;
  for (size_t i = begin; i <= end; ++i) {
    const Vec2 at = points[i].xy() - first;
    const float share = std::clamp(dot(at, way) / std::max(dot(way, way), 1e-12f), 0.0f, 1.0f);
    furthest_m = std::max(furthest_m, double{length(at - way * share)});
  }
  return furthest_m;
}

/// Returns the first fault of pieces that should follow `lines`, each from its start to its end; empty if there is
/// none.
std::string fault_of_pieces(const std::vector<ObservedPiece>& pieces, const Lines& lines, const PieceLimits& limits) {
  constexpr double kRounding_m = 5e-4;
  size_t next = 0;
  for (size_t line = 0; line < lines.points.size(); ++line) {
    const std::vector<Vec3>& points = lines.points[line];
    for (size_t begin = 0, end = 0; begin + 1 < points.size(); begin = end) {
      // Pieces of one chord, up to the line's point at which the last piece ends.
      const size_t first = next;
      for (end = begin; end == begin; ++next) {
        if (next == pieces.size()) return fmt::format("line {} lacks pieces", line);
        const ObservedPiece& piece = pieces[next];
        const double chord_m = (2.0 * static_cast<double>(next - first) + 1) * pieces[first].half_length_m;
        const Vec2 middle = points[begin].xy() + pieces[first].direction * static_cast<float>(chord_m);
        if (length(piece.middle_m.xy() - middle) > kRounding_m) return fmt::format("piece {} is elsewhere", next);
        if (2 * piece.half_length_m > limits.longest_m + kRounding_m) return fmt::format("piece {} is long", next);
        if (!is_near(piece.extent, lines.extents[line])) return fmt::format("piece {} has another extent", next);
        const Vec2 tip = middle + piece.direction * piece.half_length_m;
        for (size_t i = begin + 1; i < points.size() && end == begin; ++i) {
          if (length(points[i].xy() - tip) <= kRounding_m) end = i;
        }
      }
      const Vec3 way = points[end] - points[begin];
      if (furthest_aside_m(points, begin, end) > limits.chord_error_m + kRounding_m) {
        return fmt::format("piece {} cuts a corner", first);
      }
      if (end + 1 < points.size() && limits.ends_at_points &&
          length(points[end + 1].xy() - points[begin].xy()) < limits.longest_m - kRounding_m &&
          furthest_aside_m(points, begin, end + 1) < limits.chord_error_m - kRounding_m) {
        return fmt::format("piece {} could be longer", first);
      }
      for (size_t i = first; i < next; ++i) {
        const auto share =
            static_cast<float>((static_cast<double>(i - first) + 0.5) / static_cast<double>(next - first));
        const bool is_high = std::abs(pieces[i].middle_m.z - points[begin].z - way.z * share) > kRounding_m;
        if (is_high) return fmt::format("piece {} has another height", i);
      }
    }
  }
  return next == pieces.size() ? "" : fmt::format("{} pieces too many", pieces.size() - next);
}

/// Returns centre lines of driving, bidirectional and ramp lanes, and the maximum width of each lane.
Lines lane_lines(const RoadMap& map) {
  Lines lines;
  for (const Lane& lane : map.lanes) {
    if (!is_drivable(lane.type) || lane.type == LaneType::parking) continue;
    std::vector<Vec3>& points = lines.points.emplace_back();
    double widest_m = 0;
    for (const LanePoint& point : map.points_of(lane)) {
      points.push_back(point.position_m);
      widest_m = std::max(widest_m, double{point.width_m});
    }
    lines.extents.push_back(widest_m / 5);
  }
  return lines;
}

/// Returns road edges. Consecutive edges that share a point are joined.
Lines boundary_lines(const RoadMap& map) {
  Lines lines;
  for (const RoadEdge& edge : map.road_edges) {
    const bool goes_on = !lines.points.empty() && length(lines.points.back().back().xy() - edge.a_m.xy()) == 0;
    if (!goes_on) lines.points.push_back({edge.a_m});
    lines.points.back().push_back(edge.b_m);
  }
  lines.extents.resize(lines.points.size(), 0);
  return lines;
}

Lines wall_lines(const StaticGeometry& geometry) {
  Lines lines;
  for (const WallFace& wall : geometry.walls) {
    lines.points.push_back({wall.a_m, wall.b_m});
    lines.extents.push_back(wall.height_m / 12.0);
  }
  return lines;
}

TEST_P(ObservationOfMap, PiecesFollowLanesEdgesAndWalls) {
  if (const std::string reason = test::missing(GetParam()); !reason.empty()) GTEST_SKIP() << reason;
  const auto road = load_map(GetParam());
  const auto map = compile_map(road, {.observe_walls = true});
  EXPECT_EQ(fault_of_pieces(map->rules.lane_pieces, lane_lines(*road), kTrainingPieces), "");
  EXPECT_EQ(fault_of_pieces(map->rules.boundary_pieces, boundary_lines(*road), kTrainingPieces), "");
  EXPECT_EQ(fault_of_pieces(map->rules.wall_pieces, wall_lines(map->geometry), kTrainingPieces), "");
}

TEST(ObservationReference, HoldsInRecordedScenes) {
  const auto scene = test::crossing();
  const SimulatorConfig config = scene_config(*scene);
  MapOptions options = map_options(config);
  options.recorded_lights = true;
  for (const bool is_even : {false, true}) {
    const PieceLimits limits = is_even ? kEvenPieces : kTrainingPieces;
    options.observed_span_m = is_even ? static_cast<float>(limits.longest_m) : 0;
    const auto map = compile_scenario(scene, options, 0);
    EXPECT_EQ(fault_of_pieces(map->rules.lane_pieces, lane_lines(*map->road), limits), "");
    EXPECT_EQ(fault_of_pieces(map->rules.boundary_pieces, boundary_lines(*map->road), limits), "");
    const auto simulator = make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map)});
    std::vector<Command> commands(static_cast<size_t>(simulator->num_slots()), {.kind = CommandKind::recorded});
    commands[0] = commands[3] = {.action = kIdleAction};
    Compared compared;
    for (int step = 1; step < scene->num_steps && !HasFatalFailure(); ++step) {
      const StepResult result = simulator->step(commands);
      if (step % 15 == 0) compare(*simulator, result.terminated, &compared);
    }
    EXPECT_GT(compared.observations, 50);
    EXPECT_GT(compared.filled[static_cast<size_t>(EntitySet::controls)], 50);
  }
}

/// A known limit: in cells that no lane comes near, agents do not observe lanes and edges in range.
TEST(ObservationReference, NothingOnTheMapIsObservedFarFromLanes) {
  const auto simulator = make(cars({.num_threads = 1}), ring_road(60), {{0, 2, 0}});
  const std::vector<int32_t> slots{0, 1};
  const std::vector<float> x_m{30, 95}, y_m{0, 0}, heading_rad{kHalfPi, kHalfPi};
  simulator->set_state(
      Array(slots),
      std::vector<NamedArray>{{"x_m", Array(x_m)}, {"y_m", Array(y_m)}, {"heading_rad", Array(heading_rad)}});
  const std::vector<uint8_t> nobody(2);
  Compared compared;
  compare(*simulator, nobody, &compared);
  EXPECT_EQ(compared.far_from_lanes, 1) << "30 m inside the ring";
  EXPECT_EQ(compared.beyond_cells, 1) << "35 m outside";
  EXPECT_EQ(simulator->observations().set_counts[static_cast<size_t>(EntitySet::lanes)], 0);
}

}  // namespace
}  // namespace pictura::testing
