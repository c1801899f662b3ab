// Infractions in an evaluation: every counted case is listed, with agent, place and circumstances.
#include "pictura/evaluation/infractions.h"

#include <algorithm>

#include <gmock/gmock.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr uint32_t kScenario = 7;

// Start of a vehicle's rear axle, on a straight road along x whose two lanes lead that way at y = 0 and 4.
struct Start {
  float x_m = 0, y_m = 0, heading_rad = 0, speed_mps = 0;
};

// Origin of the map in a file with UTM coordinates.
constexpr std::array<double, 3> kOrigin_m{388096, 3948956, 12};

// Infraction of the first of two vehicles that keep their speed, within two seconds.
Infraction infraction_of_the_first(const Start& first, const Start& second, int steps = 20) {
  const auto map = testing::stadium(200, 2);
  map->origin_m = kOrigin_m;
  const auto simulator = make_simulator("cpu", testing::cars({.reset_inactive_fraction = 2}), {map},
                                        {{0, 2, kFirstEvaluationWorld + kScenario}});
  const std::vector<int32_t> slots{0, 1};
  std::vector<std::vector<float>> values;
  std::vector<NamedArray> fields;
  values.reserve(4);
  const auto add = [&](std::string_view name, float Start::* member) {
    values.push_back({first.*member, second.*member});
    fields.push_back({name, Array(values.back())});
  };
  add("x_m", &Start::x_m);
  add("y_m", &Start::y_m);
  add("heading_rad", &Start::heading_rad);
  add("speed_mps", &Start::speed_mps);
  simulator->set_state(slots, fields);
  InfractionObserver observer;
  observer.begin(*simulator);
  for (int step = 0; step < steps; ++step) {
    const std::vector<Command> commands(2);
    observer.before_step(commands);
    observer.after_step(simulator->step(Span<const Command>(commands)));
  }
  EXPECT_TRUE(observer.found().empty()) << "those of an evaluation that was interrupted are not counted";
  observer.end();
  for (const Infraction& one : observer.found()) {
    if (one.agent == 0) return one;
  }
  return {};
}

TEST(Infractions, CollisionsStateTheirPartnersAndKinds) {
  const Start driving{.x_m = 50, .speed_mps = 10};
  const Infraction behind = infraction_of_the_first(driving, {.x_m = 62});
  EXPECT_TRUE(behind.is(kEventAtFault));
  EXPECT_EQ(behind.scenario, static_cast<int>(kScenario));
  EXPECT_EQ(behind.agents_per_world, 2);
  EXPECT_EQ(behind.partner, CollisionPartner::vehicle);
  EXPECT_EQ(behind.partner_motion, PartnerMotion::standing);
  EXPECT_EQ(behind.contact, Contact::rear_end);
  EXPECT_EQ(behind.partner_agent, 1);
  EXPECT_EQ(behind.shape, RoadShape::straight);
  EXPECT_NEAR(behind.speed_mps, 10, 0.5);
  EXPECT_GT(behind.step, 3);
  EXPECT_LT(behind.step, 12);
  EXPECT_FALSE(behind.changed_lane);
  EXPECT_GT(behind.position_m[0], kOrigin_m[0] + 52);
  EXPECT_LT(behind.position_m[0], kOrigin_m[0] + 62);
  EXPECT_NEAR(behind.position_m[1], kOrigin_m[1], 0.1);
  EXPECT_NEAR(behind.position_m[2], kOrigin_m[2], 0.1);
  test::ScratchFolder folder;
  write_infractions_csv(folder / "one.csv", {behind});
  EXPECT_THAT(read_file(folder / "one.csv"), HasSubstr(",3948956.00,12.00,"));

  const Infraction moving = infraction_of_the_first(driving, {.x_m = 62, .speed_mps = 3});
  EXPECT_EQ(moving.partner_motion, PartnerMotion::moving);
  EXPECT_NEAR(moving.partner_speed_mps, 3, 0.5);
  EXPECT_EQ(infraction_of_the_first(driving, {.x_m = 66, .heading_rad = kPi}).contact, Contact::head_on);
  EXPECT_EQ(infraction_of_the_first(driving, {.x_m = 62, .y_m = -0.5f, .heading_rad = 0.5f * kPi}).contact,
            Contact::crossing);
  const Infraction beside = infraction_of_the_first({.x_m = 50, .heading_rad = 0.3f, .speed_mps = 10},
                                                    {.x_m = 52, .y_m = 4, .speed_mps = 10});
  EXPECT_EQ(beside.contact, Contact::side_swipe);
  // A standing vehicle is not at fault, and its collision partner is listed all the same.
  const Infraction hit = infraction_of_the_first({.x_m = 62}, driving);
  EXPECT_TRUE(hit.is(kEventCollision));
  EXPECT_FALSE(hit.is(kEventAtFault));
  EXPECT_EQ(hit.partner_motion, PartnerMotion::moving);
}

TEST(Infractions, WrecksAndLaneChangesAreDescribed) {
  // The second leaves the road at once and halts, across the lane of the first.
  const Infraction wreck =
      infraction_of_the_first({.x_m = 50, .speed_mps = 10}, {.x_m = 66, .y_m = -1, .heading_rad = -0.5f * kPi});
  EXPECT_TRUE(wreck.is(kEventAtFault));
  EXPECT_EQ(wreck.partner_motion, PartnerMotion::halted);
  const Infraction off = infraction_of_the_first({.x_m = 50, .heading_rad = -0.5f, .speed_mps = 10}, {.x_m = 90});
  EXPECT_TRUE(off.is(kEventOffRoad));
  EXPECT_EQ(off.partner, CollisionPartner::none);
  EXPECT_EQ(off.partner_agent, -1);
  // Across both lanes and out on the other side.
  const Infraction across = infraction_of_the_first({.x_m = 50, .heading_rad = 0.5f, .speed_mps = 10}, {.x_m = 90});
  EXPECT_TRUE(across.is(kEventOffRoad));
  EXPECT_TRUE(across.changed_lane);
}

TEST(Evaluation, CountsLivesOnOpenRoads) {
  const test::ScratchFolder folder;
  const std::string street = folder / "street.xodr";
  write_file(street, test::open_street(120));
  EvaluateOptions options;
  options.controller = "idm_lanes";
  options.maps = {street};
  options.agents_per_world = 6;
  options.scenarios = 2;
  options.steps = 400;
  options.num_threads = 1;
  options.device = options.simulator = "cpu";
  const EvaluateReport report = evaluate(options);
  const EvaluateRow& row = report.rows.at(0);
  EXPECT_EQ(row.asked, 12);
  EXPECT_LE(row.spawned, 12);
  EXPECT_GT(row.left, 12);
  EXPECT_GT(row.entered, 8);
  EXPECT_LE(row.entered, row.left);
  // There are few pedestrians and cyclists; vehicles that wait at the end are counted with their previous life.
  EXPECT_GT(row.vehicle_episodes, 12);
  EXPECT_LE(row.vehicle_episodes, row.spawned + row.entered);
  EXPECT_NEAR(row.goals_per_km.value * row.km_driven, row.goals_per_vehicle.value * double(row.vehicle_episodes), 1e-6);
  write_results(folder / "results.json", report.results);
  EXPECT_EQ(rows_of(read_results(folder / "results.json")).at(0).left, row.left);
}

TEST(Infractions, ObservedInfractionsEqualTheCountsOfTheEvaluation) {
  InfractionObserver observer;
  EvaluateOptions options;
  options.controller = "random";
  options.maps = {"procedural:1", "procedural:2"};
  options.agents_per_world = 250;
  options.first_scenario = 3;
  options.scenarios = 4;
  options.steps = 60;
  options.num_threads = 1;
  options.device = options.simulator = "cpu";
  options.observer = &observer;
  const EvaluateReport report = evaluate(options);
  int64_t at_fault = 0, off_road = 0, red_light = 0, vehicles = 0, collision = 0, wall_contact = 0;
  int64_t any_infraction = 0, at_fault_infraction = 0;
  for (const ScenarioCounts& counts : report.results.densities[0].scenarios) {
    at_fault += counts.at_fault;
    off_road += counts.off_road;
    red_light += counts.red_light;
    vehicles += counts.vehicles;
    collision += counts.collision;
    wall_contact += counts.wall_contact;
    any_infraction += counts.any_infraction;
    at_fault_infraction += counts.at_fault_infraction;
  }
  ASSERT_GT(at_fault, 0);
  ASSERT_GT(off_road, 0);
  std::map<std::string, int64_t> by_kind;
  const std::vector<InfractionGroup> groups = group_infractions(observer.found());
  for (const InfractionGroup& group : groups) by_kind[group.kind] += group.count;
  EXPECT_EQ(by_kind["at_fault"], at_fault);
  EXPECT_EQ(by_kind["off_road"], off_road);
  EXPECT_EQ(by_kind["red_light"], red_light);
  EXPECT_TRUE(std::is_sorted(groups.begin(), groups.end(),
                             [](const InfractionGroup& a, const InfractionGroup& b) { return a.count > b.count; }));
  for (int i = 0; i < options.scenarios; ++i) {
    const int worst = report.results.densities[0].worst_agents.at(static_cast<size_t>(i));
    EXPECT_TRUE(std::any_of(observer.found().begin(), observer.found().end(), [&](const Infraction& one) {
      return one.scenario == options.first_scenario + i && one.agent == worst &&
             one.agent_class == AgentClass::vehicle && one.is(kEventAtFault);
    })) << worst;
  }
  // Vehicles halt at their first event, so each is counted under its only entry.
  const auto entries_with = [&observer](int any_of) {
    return std::count_if(observer.found().begin(), observer.found().end(), [any_of](const Infraction& one) {
      return one.agent_class == AgentClass::vehicle && (one.events & any_of) != 0;
    });
  };
  EXPECT_EQ(collision, entries_with(kEventCollision));
  EXPECT_EQ(wall_contact, entries_with(kEventWall));
  EXPECT_EQ(any_infraction, entries_with(kEventCollision | kEventOffRoad | kEventRedLight));
  EXPECT_EQ(at_fault_infraction, entries_with(kEventAtFault | kEventOffRoad | kEventRedLight));
  EXPECT_GT(any_infraction, at_fault_infraction);
  for (const Infraction& one : observer.found()) {
    EXPECT_EQ(one.is(kEventCollision), one.partner != CollisionPartner::none) << one.scenario << " " << one.agent;
    EXPECT_GE(one.scenario, 3);
    EXPECT_LT(one.scenario, 7);
    EXPECT_EQ(one.map, one.scenario % 2 == 0 ? "procedural:1" : "procedural:2");
    EXPECT_EQ(one.is(kEventRedLight), one.stop_line_to_head_m > 0);
  }

  test::ScratchFolder folder;
  write_infractions_csv(folder / "all.csv", observer.found());
  const std::string text = read_file(folder / "all.csv");
  EXPECT_THAT(text, StartsWith("agents,scenario,map,agent,class,step,at_fault"));
  EXPECT_EQ(static_cast<size_t>(std::count(text.begin(), text.end(), '\n')), observer.found().size() + 1);
  EXPECT_THAT(text, HasSubstr("\"procedural:1\""));
}

/// Accelerates all agents, who do not steer.
class StraightOn final : public Controller {
 public:
  std::string_view name() const override { return "straight on"; }
  void act(const SimulatorArrays& /*input*/, Span<const uint8_t> /*mask*/, Span<Command> commands_out,
           Stream /*stream*/) override {
    for (Command& command : commands_out) command = {.action = 3 * kNumLatActions + 1};
  }
};

TEST(Infractions, DescribeALightThatWasRedWhenItsLineWasCrossed) {
  InfractionObserver observer;
  EvaluateOptions options;
  options.make_own_controller = [](const DriverOptions&, const Simulator&, Renderer*) {
    return std::make_unique<StraightOn>();
  };
  options.controller = "straight on";
  options.maps = {"procedural:1", "procedural:2"};
  options.agents_per_world = 250;
  options.scenarios = 8;
  options.steps = 100;
  options.light_cycles = LightCycles::independent;
  options.device = options.simulator = "cpu";
  options.observer = &observer;
  evaluate(options);
  int red_lights = 0;
  for (const Infraction& one : observer.found()) {
    red_lights += one.is(kEventRedLight);
    EXPECT_EQ(one.is(kEventRedLight), one.red_for_s > 0) << one.scenario << " " << one.agent << " " << one.step;
  }
  EXPECT_GT(red_lights, 20);
}

}  // namespace
}  // namespace pictura
