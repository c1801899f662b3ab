// Simulator::observe: observations with boxes hidden or inserted.
#include <algorithm>
#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/tests/simulator/random_edit.h"
#include "pictura/tests/simulator/random_queries.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using testing::AnswerMemory;
using testing::observation_of;

/// Makes a simulator whose agents have driven, halted and left. Some agents find no place.
std::unique_ptr<Simulator> busy(SimulatorConfig config) {
  config.pedestrian_fraction = config.cyclist_fraction = 0.2f;
  config.parked_cars = 20;
  config.reset_inactive_fraction = 2;
  auto simulator = make_simulator("cpu", config, {load_map("procedural:1"), testing::stadium(200, 2)},
                                  {{0, 90, 0}, {1, 40, 1}, {0, 3, 2}, {1, 1, 3}});
  const testing::RandomEdit edit(simulator->state(), simulator->num_slots(), 3);
  simulator->set_state(edit.slots(), edit.fields());
  for (uint32_t step = 0; step < 12; ++step) {
    simulator->step(testing::mixed_actions(simulator->num_slots(), step));
  }
  return simulator;
}

/// Makes cars in two rows, each a little farther from the first car, which is at x = 20 m.
std::unique_ptr<Simulator> queue_of(int num_cars, float gap_m, SimulatorConfig config = testing::cars()) {
  auto simulator = make_simulator("cpu", config, {testing::stadium(300, 2)}, {{0, num_cars, 0}});
  std::vector<int32_t> slots;
  std::vector<float> x_m, y_m, zeros, speed_mps;
  for (int i = 0; i < num_cars; ++i) {
    slots.push_back(i);
    x_m.push_back(20 + gap_m * static_cast<float>(i));
    y_m.push_back(i % 2 ? 4.0f : 0.0f);
    zeros.push_back(0);
    speed_mps.push_back(static_cast<float>(i));
  }
  simulator->set_state(
      slots,
      std::vector<NamedArray>{
          {"x_m", Array(x_m)}, {"y_m", Array(y_m)}, {"heading_rad", Array(zeros)}, {"speed_mps", Array(speed_mps)}});
  return simulator;
}

void set_absent(Simulator* simulator, int32_t slot) {
  const std::vector<int32_t> slots{slot};
  const std::vector<AgentStatus> absent{AgentStatus::absent};
  simulator->set_state(slots, std::vector<NamedArray>{{"status", Array(absent)}});
}

int32_t box_of_slot(Simulator* simulator, int32_t slot) { return simulator->views()[slot].ego_agent; }

Span<const float> partner(const ObservationView& observation, int row) {
  return observation.partners.subspan(static_cast<size_t>(row) * kPartnerFeatures, kPartnerFeatures);
}

TEST(ObservationQueries, EqualTheObservationsWithoutChanges) {
  for (const bool auxiliary : {true, false}) {
    for (const bool walls : {true, false}) {
      for (const bool sets : {true, false}) {
        const SimulatorConfig config{
            .auxiliary_observations = auxiliary, .vector_observations = sets, .wall_observations = walls};
        const auto simulator = busy(config);
        std::vector<ObservationQuery> queries;
        std::array<int, 4> of_status{};
        for (int slot = simulator->num_slots() - 1; slot >= 0; --slot) {
          queries.push_back({.slot = slot, .leaves_gaps = slot % 2});
          ++of_status[static_cast<int>(simulator->state().status[slot])];
        }
        for (const AgentStatus status : {AgentStatus::active, AgentStatus::halted, AgentStatus::absent}) {
          ASSERT_GT(of_status[static_cast<int>(status)], 0);
        }
        AnswerMemory answers(queries.size(), simulator->config());
        simulator->observe(queries, {}, {}, answers.view());
        for (size_t i = 0; i < queries.size(); ++i) {
          const auto slot = static_cast<size_t>(queries[i].slot);
          ASSERT_EQ(testing::first_difference(observation_of(answers.view(), i),
                                              observation_of(simulator->observations(), slot)),
                    "")
              << "slot " << slot << ", auxiliary " << auxiliary << ", walls " << walls << ", sets " << sets;
        }
      }
    }
  }
}

TEST(ObservationQueries, HidingAnAgentEqualsAWorldWithoutIt) {
  int changed = 0, unchanged = 0;
  for (const int32_t gone : {1, 9, 20}) {
    const auto simulator = queue_of(24, 3.5f), without = queue_of(24, 3.5f);
    set_absent(without.get(), gone);
    std::vector<ObservationQuery> queries;
    for (int slot = 0; slot < 24; ++slot) {
      if (slot != gone) queries.push_back({.slot = slot, .hidden_begin = 0, .hidden_end = 1});
    }
    const std::vector<int32_t> hidden{box_of_slot(simulator.get(), gone)};
    AnswerMemory answers(queries.size(), simulator->config());
    simulator->observe(queries, hidden, {}, answers.view());
    for (size_t i = 0; i < queries.size(); ++i) {
      const auto slot = static_cast<size_t>(queries[i].slot);
      const ObservationView answer = observation_of(answers.view(), i);
      EXPECT_EQ(testing::first_difference(answer, observation_of(without->observations(), slot)), "")
          << "slot " << slot << " without " << gone;
      EXPECT_EQ(answer.set_counts[0], kMaxPartners) << "the 17th has come in";
      const bool is_same = testing::first_difference(answer, observation_of(simulator->observations(), slot)).empty();
      ++(is_same ? unchanged : changed);
    }
  }
  EXPECT_GT(changed, 20) << "who sees it";
  EXPECT_GT(unchanged, 20) << "who has sixteen nearer ones";
}

TEST(ObservationQueries, ANextPartnerReplacesAHiddenOneUnlessGapsAreKept) {
  const auto simulator = queue_of(20, 4);
  const ObservationView before = observation_of(simulator->observations(), 0);
  // Partners of slot 0 are 1 to 16; the third is hidden.
  const std::vector<int32_t> hidden{box_of_slot(simulator.get(), 3)};
  const std::vector<ObservationQuery> queries{{.hidden_end = 1}, {.hidden_end = 1, .leaves_gaps = 1}};
  AnswerMemory answers(2, simulator->config());
  simulator->observe(queries, hidden, {}, answers.view());
  const ObservationView without = observation_of(answers.view(), 0), emptied = observation_of(answers.view(), 1);
  EXPECT_EQ(without.set_counts[0], kMaxPartners);
  EXPECT_EQ(emptied.set_counts[0], kMaxPartners);
  for (int row = 0; row < kMaxPartners; ++row) {
    if (row == 2) {
      for (const float value : partner(emptied, row)) EXPECT_EQ(value, 0);
    } else {
      EXPECT_TRUE(testing::same_bits(partner(emptied, row), partner(before, row))) << row;
    }
    if (row == kMaxPartners - 1) break;
    EXPECT_TRUE(testing::same_bits(partner(without, row), partner(before, row < 2 ? row : row + 1))) << row;
  }
  const AgentStateView state = simulator->state();
  const float center_m = state.x_m[17] + 0.5f * kWheelbasePerLength * state.length_m[17];
  EXPECT_NEAR(partner(without, 15)[0] * kScalePosition_m, center_m - 20, 1e-3f) << "the 17th";
  EXPECT_NEAR(partner(without, 15)[7] * kScaleSpeed_mps, 17, 1e-4f) << "with its speed";
}

TEST(ObservationQueries, HidingAgentsOutOfRangeOrTheAgentItselfChangesNothing) {
  const auto simulator = queue_of(12, 20);
  const std::vector<int32_t> hidden{box_of_slot(simulator.get(), 8), box_of_slot(simulator.get(), 0)};
  ASSERT_GT(simulator->state().x_m[8] - simulator->state().x_m[0], kPartnerRange_m);
  for (const int32_t leaves_gaps : {0, 1}) {
    const std::vector<ObservationQuery> queries{{.hidden_end = 2, .leaves_gaps = leaves_gaps}};
    AnswerMemory answers(1, simulator->config());
    simulator->observe(queries, hidden, {}, answers.view());
    EXPECT_EQ(testing::first_difference(answers.view(), observation_of(simulator->observations(), 0)), "");
  }
}

TEST(ObservationQueries, ABoxInsertedAtAHiddenAgentEqualsThatAgent) {
  for (const bool auxiliary : {true, false}) {
    SimulatorConfig config = testing::cars();
    config.auxiliary_observations = auxiliary;
    const auto simulator = queue_of(20, 4, config);
    const std::vector<int32_t> hidden{box_of_slot(simulator.get(), 5)};
    const InsertedBox same{simulator->scene().agents[hidden[0]], 5};
    InsertedBox invisible = same;
    invisible.box.drawn = 0;
    const std::vector<InsertedBox> inserted{same, invisible};
    const std::vector<ObservationQuery> queries{{.hidden_end = 1, .inserted_end = 2}, {.hidden_end = 1}};
    AnswerMemory answers(2, simulator->config());
    simulator->observe(queries, hidden, inserted, answers.view());
    const ObservationView before = observation_of(simulator->observations(), 0);
    EXPECT_EQ(testing::first_difference(observation_of(answers.view(), 0), before), "");
    EXPECT_NE(testing::first_difference(observation_of(answers.view(), 1), before), "");
  }
}

TEST(ObservationQueries, APhantomAheadIsTheFirstPartner) {
  const auto simulator = queue_of(20, 10);
  InsertedBox phantom;
  phantom.box.center_m = {24, 1, 0.5f};
  phantom.box.cos_heading = 0;
  phantom.box.sin_heading = 1;
  phantom.box.length_m = 3;
  phantom.box.width_m = 1.5f;
  phantom.speed_mps = -1;
  const std::vector<InsertedBox> inserted{phantom};
  const std::vector<ObservationQuery> queries{{.inserted_end = 1}};
  AnswerMemory answers(1, simulator->config());
  simulator->observe(queries, {}, inserted, answers.view());
  const ObservationView before = observation_of(simulator->observations(), 0);
  ASSERT_LT(before.set_counts[0], kMaxPartners);
  EXPECT_EQ(answers.view().set_counts[0], before.set_counts[0] + 1);
  const float expected[kPartnerFeatures] = {4 / 120.0f, 1 / 120.0f, 0.05f, 0.5f, 0.5f, 0, 1, -0.05f};
  for (size_t f = 0; f < kPartnerFeatures; ++f) EXPECT_NEAR(answers.view().partners[f], expected[f], 1e-6f) << f;
  for (int row = 0; row < before.set_counts[0]; ++row) {
    EXPECT_TRUE(testing::same_bits(partner(answers.view(), row + 1), partner(before, row)));
  }
}

/// Expected rows of answers, found by sorting all boxes that are present.
TEST(ObservationQueries, ShowTheNearestOfAnyHiddenAndInserted) {
  const auto simulator = busy({});
  const testing::RandomQueries drawn(simulator.get(), 600, 1);
  AnswerMemory answers(drawn.queries.size(), simulator->config());
  const std::vector<uint8_t> before = simulator->save();
  simulator->observe(drawn.queries, drawn.hidden, drawn.inserted, answers.view());
  EXPECT_EQ(simulator->save(), before);
  const SceneBatch& scene = simulator->scene();
  const AgentStateView state = simulator->state();
  int shown_inserted = 0, gaps = 0, full = 0;
  for (size_t i = 0; i < drawn.queries.size(); ++i) {
    SCOPED_TRACE(i);
    const ObservationQuery& query = drawn.queries[i];
    const ObservationView answer = observation_of(answers.view(), i);
    const ObservationView ordinary = observation_of(simulator->observations(), static_cast<size_t>(query.slot));
    ObservationView others = answer, ordinary_others = ordinary;
    for (ObservationView* each : {&others, &ordinary_others}) {
      each->partners = {};
      each->set_counts = each->set_counts.subspan(1, kNumEntitySets - 1);
    }
    ASSERT_EQ(testing::first_difference(others, ordinary_others), "");
    const View& view = simulator->views()[query.slot];
    if (state.status[query.slot] != AgentStatus::active && ordinary.ego[1] == 0) {
      ASSERT_EQ(answer.set_counts[0], 0);
      for (const float value : answer.partners) ASSERT_EQ(value, 0);
      continue;
    }
    struct Met {
      double distance_m;
      const AgentBox* box;
      float speed_mps;
      bool is_gap;
    };
    std::vector<Met> met;
    const auto meet = [&](const AgentBox& box, float speed_mps, bool is_gap) {
      const double distance_m = std::hypot(box.center_m.x - view.origin_m.x, box.center_m.y - view.origin_m.y);
      if (box.drawn && distance_m < kPartnerRange_m) met.push_back({distance_m, &box, speed_mps, is_gap});
    };
    const auto world = static_cast<size_t>(view.world);
    const int32_t first_slot = simulator->slots().slot_begin[world], first_box = scene.world_begin[world];
    const int32_t num_agents = simulator->slots().slot_begin[world + 1] - first_slot;
    for (int32_t box = first_box; box < scene.world_begin[world + 1]; ++box) {
      const auto* const begin = drawn.hidden.data();
      const bool is_hidden =
          std::find(begin + query.hidden_begin, begin + query.hidden_end, box) != begin + query.hidden_end;
      if (box == view.ego_agent || (is_hidden && !query.leaves_gaps)) continue;
      const bool drives = box - first_box < num_agents;
      meet(scene.agents[box], drives ? state.speed_mps[first_slot + box - first_box] : 0, is_hidden);
    }
    for (int32_t k = query.inserted_begin; k < query.inserted_end; ++k) {
      const InsertedBox& one = drawn.inserted[k];
      meet(one.box, one.speed_mps, false);
    }
    std::stable_sort(met.begin(), met.end(), [](const Met& a, const Met& b) { return a.distance_m < b.distance_m; });
    const int count = std::min<int>(kMaxPartners, static_cast<int>(met.size()));
    full += met.size() > kMaxPartners;
    ASSERT_EQ(answer.set_counts[0], count);
    for (int row = 0; row < kMaxPartners; ++row) {
      const Met nobody{0, nullptr, 0, true};
      const Met& one = row < count ? met[row] : nobody;
      float expected[kPartnerFeatures] = {};
      if (!one.is_gap) {
        const Vec3 apart = one.box->center_m - view.origin_m;
        const float c = view.cos_heading, s = view.sin_heading;
        const float box_c = one.box->cos_heading, box_s = one.box->sin_heading;
        const float values[kPartnerFeatures] = {(apart.x * c + apart.y * s) / 120,
                                                (apart.y * c - apart.x * s) / 120,
                                                apart.z / 10,
                                                one.box->length_m / 6,
                                                one.box->width_m / 3,
                                                box_c * c + box_s * s,
                                                box_s * c - box_c * s,
                                                one.speed_mps / 20};
        std::copy(std::begin(values), std::end(values), expected);
        shown_inserted += one.box >= &drawn.inserted.front().box && one.box <= &drawn.inserted.back().box;
      } else {
        gaps += row < count;
      }
      for (size_t f = 0; f < kPartnerFeatures; ++f) ASSERT_NEAR(partner(answer, row)[f], expected[f], 1e-5f) << row;
    }
  }
  EXPECT_GT(shown_inserted, 100);
  EXPECT_GT(gaps, 100);
  EXPECT_GT(full, 100);
}

TEST(ObservationQueries, DoNotChangeTheSimulator) {
  const auto simulator = busy({.wall_observations = true});
  const std::vector<int32_t> actions = testing::mixed_actions(simulator->num_slots(), 99);
  const StepResult result = simulator->step(actions);
  const std::vector<float> reward(result.reward.begin(), result.reward.end());
  const std::vector<float> partners(simulator->observations().partners.begin(),
                                    simulator->observations().partners.end());
  const std::vector<View> views(simulator->views().begin(), simulator->views().end());
  const std::vector<uint8_t> state = simulator->save();
  const testing::RandomQueries drawn(simulator.get(), 50, 2);
  AnswerMemory answers(drawn.queries.size(), simulator->config());
  simulator->observe(drawn.queries, drawn.hidden, drawn.inserted, answers.view());
  simulator->observe({}, drawn.hidden, drawn.inserted, {});
  EXPECT_EQ(simulator->save(), state);
  EXPECT_TRUE(testing::same_bits(result.reward, Span<const float>(reward)));
  EXPECT_TRUE(testing::same_bits(Span<const float>(simulator->observations().partners), Span<const float>(partners)));
  EXPECT_TRUE(testing::same_bits(simulator->views(), Span<const View>(views)));
}

TEST(ObservationQueries, ErrorsNameInvalidQueriesAndWriteNothing) {
  const auto simulator = make_simulator("cpu", testing::cars(), {testing::stadium(200, 2)}, {{0, 4, 0}, {0, 3, 1}});
  AnswerMemory answers(2, simulator->config()), untouched(2, simulator->config());
  const std::vector<int32_t> hidden{1, 5};
  InsertedBox sound, unsound;
  unsound.box.width_m = NAN;
  const std::vector<InsertedBox> inserted{sound, unsound};
  const auto refusal = [&](const ObservationQuery& second) {
    const std::vector<ObservationQuery> queries{{.slot = 0, .hidden_end = 1, .inserted_end = 1}, second};
    const std::string message =
        test::message_of([&] { simulator->observe(queries, hidden, inserted, answers.view()); });
    EXPECT_EQ(testing::first_difference(answers.view(), untouched.view()), "") << message;
    return message;
  };
  EXPECT_EQ(refusal({.slot = 7}), "observe: query 1: expected a slot in [0, 7), got 7");
  EXPECT_EQ(refusal({.slot = -1}), "observe: query 1: expected a slot in [0, 7), got -1");
  EXPECT_EQ(refusal({.hidden_begin = -1}),
            "observe: query 1: hidden_begin: expected 0 to the length of the list of hidden boxes, got -1");
  EXPECT_EQ(refusal({.hidden_begin = 3, .hidden_end = 3}),
            "observe: query 1: hidden_begin: expected 0 to the length of the list of hidden boxes, got 3");
  EXPECT_EQ(refusal({.hidden_end = 3}),
            "observe: query 1: hidden_end: expected hidden_begin to the length of the list of hidden boxes, got 3");
  EXPECT_EQ(refusal({.hidden_begin = 2, .hidden_end = 1}),
            "observe: query 1: hidden_end: expected hidden_begin to the length of the list of hidden boxes, got 1");
  EXPECT_EQ(refusal({.slot = 3, .hidden_end = 2}),
            "observe: query 1: hidden: expected boxes of the slot's own world, got box 5 of the scene");
  EXPECT_EQ(refusal({.slot = 4, .hidden_end = 2}),
            "observe: query 1: hidden: expected boxes of the slot's own world, got box 1 of the scene");
  EXPECT_EQ(refusal({.inserted_begin = -2}),
            "observe: query 1: inserted_begin: expected 0 to the length of the list of inserted boxes, got -2");
  EXPECT_EQ(
      refusal({.inserted_begin = 1, .inserted_end = 9}),
      "observe: query 1: inserted_end: expected inserted_begin to the length of the list of inserted boxes, got 9");
  EXPECT_EQ(refusal({.inserted_end = 2}),
            "observe: query 1: inserted: expected finite numbers, got non-finite numbers in box 1 of the list");
}

TEST(ObservationQueries, RefuseAnswerArraysOfOtherSizes) {
  const auto simulator = make_simulator("cpu", testing::cars(), {testing::stadium(200, 2)}, {{0, 4, 0}});
  const std::vector<ObservationQuery> queries(2);
  AnswerMemory answers(2, simulator->config());
  std::vector<float> walls(2 * kMaxWalls * kWallFeatures);
  const auto refusal = [&](const ObservationView& out) {
    return test::message_of([&] { simulator->observe(queries, {}, {}, out); });
  };
  ObservationView out = answers.view();
  out.lanes = out.lanes.subspan(0, 559);
  EXPECT_EQ(refusal(out), "observe: out: lanes: expected [2, 80, 7], 1120 values, got 559");
  out = answers.view();
  out.waypoints = {};
  EXPECT_EQ(refusal(out), "observe: out: waypoints: expected [2, 3, 3], 18 values, got 0");
  out = answers.view();
  out.walls = walls;
  EXPECT_EQ(refusal(out),
            "observe: out: walls: expected no values, since this simulator does not observe it, got 1120");
}

}  // namespace
}  // namespace pictura
