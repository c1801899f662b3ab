// The probe of blind corners: states that it finds and matches, takeovers and their controls, and means.
#include "pictura/evaluation/probes/corner.h"

#include <cmath>
#include <set>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "pictura/map/load_map.h"
#include "pictura/map/map_geometry.h"
#include "pictura/policy/session.h"
#include "pictura/tests/evaluation/probed_policies.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::kAgent;
using test::kLikeForLike;
using test::kVectorized;
using test::message_of;
using test::read_table;
using ::testing::HasSubstr;

// ---- states

TEST(BlindCorners, LieAtJunctionsWithoutLights) {
  const auto map = load_map("procedural:1");
  const BlindCorners corners = find_blind_corners(*map, make_walls(*map, {}));
  ASSERT_GT(corners.size(), 4u);
  const std::set<int32_t> lit(map->light_lanes.begin(), map->light_lanes.end());
  for (const auto& [approach, corner] : corners) {
    EXPECT_FALSE(lit.contains(approach));
    EXPECT_FALSE(map->lanes[approach].in_junction);
    EXPECT_EQ(map->junctions[corner.junction].num_phases, 0);
    EXPECT_FALSE(corner.lanes.empty());
    for (const auto& [lane, entry_m] : corner.lanes) EXPECT_NE(lane, approach);
  }
  EXPECT_TRUE(find_blind_corners(*map, {}).empty());
}

CornerState state(int scene, int ego, float distance_m, float speed_mps, int user = -1, int step = 10) {
  return {.scene = scene,
          .step = step,
          .ego = ego,
          .approach = 1,
          .user = user,
          .distance_m = distance_m,
          .speed_mps = speed_mps};
}

TEST(CornerPairs, HaveSimilarDistancesAndSpeeds) {
  const std::vector<CornerState> hidden{state(1, 0, 20, 5, 7)};
  EXPECT_TRUE(match_corners(hidden, {state(2, 0, 21.1f, 5), state(2, 1, 20, 5.6f)}, 9).empty());
  EXPECT_TRUE(match_corners(hidden, {state(1, 0, 20, 5)}, 9).empty()) << "the same ego";
  const auto pairs = match_corners(hidden, {state(2, 0, 20.5f, 5), state(3, 1, 20.1f, 5.1f), state(4, 0, 19, 5)}, 9);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].empty.scene, 3) << "the likest";
}

TEST(CornerPairs, UseEachVehicleOnceAndCycleThroughScenes) {
  // Ego 0 has two states with the same user; the second empty ego waits for a user for which the first is not similar
  // enough.
  const std::vector<CornerState> hidden{state(1, 0, 20, 5, 7, 20), state(1, 0, 21, 5, 7, 10), state(1, 2, 20, 5, 7),
                                        state(2, 0, 20, 5, 7)};
  const std::vector<CornerState> empty{state(5, 0, 20, 5, -1, 10), state(5, 0, 20.2f, 5, -1, 15), state(5, 1, 21, 5)};
  const auto pairs = match_corners(hidden, empty, 9);
  ASSERT_EQ(pairs.size(), 2u) << "an empty corner serves once";
  EXPECT_EQ(pairs[0].hidden.scene, 1);
  EXPECT_EQ(pairs[0].hidden.step, 10) << "the first state of an ego and a user";
  EXPECT_EQ(pairs[1].hidden.scene, 2) << "scenes in turn";
  EXPECT_NE(pairs[0].empty.ego, pairs[1].empty.ego);
  EXPECT_EQ(match_corners(hidden, empty, 1).size(), 1u);
}

// ---- the probe

bool same_runs(const CornerResults& a, const CornerResults& b) {
  if (a.takeovers.size() != b.takeovers.size()) return false;
  const auto same = [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  for (size_t i = 0; i < a.takeovers.size(); ++i) {
    const Takeover &x = a.takeovers[i], &y = b.takeovers[i];
    if (x.steps != y.steps || x.input_step != y.input_step || x.sight_step != y.sight_step) return false;
    if (!std::equal(x.speed_mps.begin(), x.speed_mps.end(), y.speed_mps.begin(), same)) return false;
    if (!std::equal(x.x_m.begin(), x.x_m.end(), y.x_m.begin(), same)) return false;
  }
  return true;
}

/// Corners in towns through which the lane keeper drives.
struct CornerKind {
  using Options = CornerOptions;
  using Results = CornerResults;
  static constexpr int64_t kCases = 12;
  static void set_cases(int64_t pairs, CornerOptions* options) {
    options->worlds.controller = "lane";
    options->worlds.agents_per_world = 90;
    options->worlds.steps = 300;
    options->sample_steps = 5;
    options->pairs = pairs;
  }
  static CornerResults probe(const CornerOptions& options) { return probe_corner(options); }
  static bool is_same(const CornerResults& a, const CornerResults& b) { return same_runs(a, b); }
};
using Corner = test::ProbeTest<CornerKind>;

TEST_F(Corner, PairsAreFoundAndAllPoliciesStartInTheSameState) {
  const CornerResults& all = results();
  ASSERT_GE(all.pairs.size(), 8u) << "of " << all.hidden_found << " hidden and " << all.empty_found << " empty states";
  ASSERT_EQ(all.takeovers.size(), all.pairs.size() * 2 * kCornerCases * 3);
  size_t at_once = 0;
  EXPECT_GE(all.hidden_found, static_cast<int64_t>(all.pairs.size()));
  for (size_t pair = 0; pair < all.pairs.size(); ++pair) {
    const CornerState &hidden = all.pairs[pair].hidden, &empty = all.pairs[pair].empty;
    EXPECT_GE(hidden.user, 0);
    EXPECT_EQ(empty.user, -1);
    EXPECT_EQ(all.driver_name(hidden.driver), "lane");
    EXPECT_LE(std::abs(hidden.distance_m - empty.distance_m), kSameDistance_m);
    EXPECT_LE(std::abs(hidden.speed_mps - empty.speed_mps), kSameSpeed_mps);
    EXPECT_GE(hidden.distance_m, 8);
    EXPECT_LE(hidden.distance_m, 25);
    for (const bool walls : {true, false}) {
      for (const CornerCase its_case : {CornerCase::hidden, CornerCase::removed, CornerCase::empty}) {
        for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
          const Takeover& run = all.takeover(pair, walls, its_case, policy);
          EXPECT_EQ(run.speed_mps[0], (its_case == CornerCase::empty ? empty : hidden).speed_mps);
          EXPECT_EQ(std::isfinite(run.speed_mps[kTakeoverSteps]), run.ended_by == 0);
          EXPECT_NE(run.sight_step, 0) << "who is hidden is hidden at the takeover";
          if (its_case != CornerCase::hidden) {
            EXPECT_EQ(run.input_step, -1);
          }
        }
      }
    }
    EXPECT_NE(all.takeover(pair, true, CornerCase::hidden, kAgent).input_step, 0);
    at_once += all.takeover(pair, true, CornerCase::hidden, kVectorized).input_step == 0;
  }
  EXPECT_GT(at_once, all.pairs.size() / 2) << "vectors hold whom cameras do not see";
}

TEST_F(Corner, UnseenVehiclesChangeNothingForCamerasAndMuchForVectors) {
  const CornerResults& all = results();
  size_t compared = 0;
  std::array<size_t, 3> differ{};
  for (size_t pair = 0; pair < all.pairs.size(); ++pair) {
    for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
      const Takeover &run = all.takeover(pair, true, CornerCase::hidden, policy),
                     &without = all.takeover(pair, true, CornerCase::removed, policy);
      // Compared up to the step at which a camera sees the vehicle: its decision shows in the next state.
      const int32_t first_seen = all.takeover(pair, true, CornerCase::hidden, kAgent).input_step;
      const auto end = static_cast<size_t>(first_seen < 0 ? kTakeoverSteps : first_seen);
      compared += policy == kAgent ? end : 0;
      bool is_same = true;
      for (size_t k = 0; k <= end; ++k) {
        is_same &= run.x_m[k] == without.x_m[k] || (std::isnan(run.x_m[k]) && std::isnan(without.x_m[k]));
        is_same &= run.speed_mps[k] == without.speed_mps[k] || std::isnan(run.speed_mps[k]);
      }
      differ[policy] += !is_same;
    }
  }
  EXPECT_GT(compared, 50u) << "steps in which it is not seen";
  EXPECT_EQ(differ[kAgent], 0u);
  EXPECT_GT(differ[kVectorized] + differ[kLikeForLike], 0u);
}

TEST_F(Corner, WithoutWallsTheVehicleIsVisibleFromTheStart) {
  const CornerResults& all = results();
  size_t sooner = 0, later = 0;
  for (size_t pair = 0; pair < all.pairs.size(); ++pair) {
    const int32_t with = all.takeover(pair, true, CornerCase::hidden, kAgent).input_step,
                  open = all.takeover(pair, false, CornerCase::hidden, kAgent).input_step;
    sooner += open >= 0 && (with < 0 || open < with);
    later += with >= 0 && (open < 0 || open > with);
  }
  EXPECT_GT(sooner, all.pairs.size() / 2);
  EXPECT_EQ(later, 0u);
}

// Vectors hold no walls: without walls these policies drive the same, among the same parked cars, up to where walls end
// a run. Also at empty corners.
TEST_F(Corner, TheOpenConditionRemovesOnlyWalls) {
  const CornerResults& all = results();
  size_t compared = 0;
  for (size_t pair = 0; pair < all.pairs.size(); ++pair) {
    for (const CornerCase its_case : {CornerCase::hidden, CornerCase::removed, CornerCase::empty}) {
      for (const size_t policy : {kVectorized, kLikeForLike}) {
        const Takeover &with = all.takeover(pair, true, its_case, policy),
                       &open = all.takeover(pair, false, its_case, policy);
        const bool hits_wall = (with.ended_by & kEventWall) != 0;
        for (size_t k = 0; k <= kTakeoverSteps && std::isfinite(with.x_m[k]); ++k)
          EXPECT_EQ(with.x_m[k], open.x_m[k]) << "pair " << pair << ", step " << k;
        EXPECT_TRUE(hits_wall || (with.steps == open.steps && with.ended_by == open.ended_by)) << "pair " << pair;
        compared += !hits_wall;
      }
    }
  }
  EXPECT_GT(compared, all.pairs.size());
}

TEST_F(Corner, BatchSizeDoesNotChangeResults) {
  ASSERT_GT(results().pairs.size(), static_cast<size_t>(takeover_pass({}))) << "else there is but one batch";
  expect_the_same_of_batches({1});
}

TEST_F(Corner, ThePermutedControlRemovesAnotherVehicle) {
  const CornerResults permuted = controlled(CornerControl::permuted);
  const CornerResults& all = results();
  ASSERT_EQ(permuted.pairs.size(), all.pairs.size());
  size_t removed = 0, differ = 0;
  for (size_t pair = 0; pair < all.pairs.size(); ++pair) {
    const CornerState& state = permuted.pairs[pair].hidden;
    const int32_t other = permuted.scenes_of_pairs[pair].removed;
    EXPECT_EQ(all.scenes_of_pairs[pair].removed, state.user);
    EXPECT_NE(other, state.user);
    EXPECT_NE(other, state.ego);
    removed += other >= 0;
    for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
      const auto input_of = [&](const CornerResults& some, CornerCase its_case) {
        return some.takeover(pair, true, its_case, policy).input_step;
      };
      EXPECT_EQ(input_of(permuted, CornerCase::hidden), input_of(all, CornerCase::hidden));
      EXPECT_EQ(input_of(all, CornerCase::removed), -1);
      differ += input_of(permuted, CornerCase::removed) >= 0;  // the hidden vehicle is present
    }
  }
  EXPECT_GT(removed, all.pairs.size() / 2);
  EXPECT_GT(differ, 0u);
}

TEST_F(Corner, UntrainedPoliciesTakeOverInTheSameStates) {
  const CornerResults control = controlled(CornerControl::untrained);
  const CornerResults& all = results();
  ASSERT_EQ(control.pairs.size(), all.pairs.size());
  std::array<size_t, 3> differ{};
  for (size_t pair = 0; pair < all.pairs.size(); ++pair) {
    EXPECT_EQ(control.scenes_of_pairs[pair].removed, all.scenes_of_pairs[pair].removed);
    for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
      const Takeover &run = control.takeover(pair, true, CornerCase::hidden, policy),
                     &without = control.takeover(pair, true, CornerCase::removed, policy),
                     &trained = all.takeover(pair, true, CornerCase::hidden, policy);
      EXPECT_EQ(run.speed_mps[0], trained.speed_mps[0]);
      differ[policy] += run.x_m[10] != trained.x_m[10];
      if (policy != kAgent) continue;
      const int32_t end = run.input_step < 0 ? run.steps : std::min(run.input_step, run.steps);
      for (size_t k = 0; k < static_cast<size_t>(end); ++k)
        EXPECT_EQ(run.x_m[k], without.x_m[k]) << "nobody is seen, pair " << pair << ", step " << k;
    }
  }
  for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
    EXPECT_GT(differ[policy], 0u) << policy;
    EXPECT_EQ(control.policies[policy].hash, all.policies[policy].hash);
    EXPECT_NE(control.policies[policy].untrained_hash, control.policies[policy].hash);
  }
}

TEST_F(Corner, SeedsDetermineTheStates) {
  CornerOptions one = options(4);
  one.policies = {policies_[kAgent]};
  CornerOptions other = one;
  other.worlds.seed = 2;
  const auto states_of = [](const CornerResults& some) {
    std::set<std::tuple<int, int, int, int>> states;
    for (const CornerPair& pair : some.pairs)
      states.insert({pair.hidden.scene, pair.hidden.step, pair.hidden.ego, pair.hidden.user});
    return states;
  };
  EXPECT_NE(states_of(probe_corner(one)), states_of(probe_corner(other)));
}

TEST_F(Corner, RefusesInvalidOptions) {
  CornerOptions o = options(2);
  o.worlds.steps = 85;
  EXPECT_THAT(message_of([&] { probe(o); }), HasSubstr("more than 85 steps, of which a takeover takes 80, got 85"));
  o = options(2);
  o.search.max_distance_m = 5;
  EXPECT_THAT(message_of([&] { probe(o); }), HasSubstr("distances of 0 to 60 m in ascending order, got 8 and 5"));
}

// ---- results

/// Run eastwards from x = 0 at a speed that falls by 1 m/s each second, for `steps` steps.
Takeover run_of(float speed_mps, int32_t steps, int32_t sight_step) {
  Takeover run;
  run.steps = steps;
  run.ended_by = steps < kTakeoverSteps ? 1 : 0;
  run.sight_step = sight_step;
  run.input_step = sight_step < 0 ? -1 : sight_step + 1;
  run.sight_distance_m = sight_step < 0 ? NAN : 30;
  for (size_t k = 0; k < static_cast<size_t>(steps) + (run.ended_by == 0); ++k) {
    run.speed_mps[k] = std::max(0.0f, speed_mps - 0.1f * static_cast<float>(k));
    run.x_m[k] = 0.5f * static_cast<float>(k);
    run.y_m[k] = 0;
  }
  return run;
}

/// Two pairs of two scenes and two policies; the second policy is 2 m/s faster if a vehicle is hidden.
CornerResults made_up_corners() {
  CornerResults all;
  all.setting.maps = {"a"};
  all.policies = {{"one", "one.ckpt", "h", true}, {"two", "two.ckpt", "h", false}};
  all.scenes = 2;
  all.pairs_asked = 3;
  all.pairs = {{state(3, 0, 20, 5, 7), state(4, 1, 20.5f, 5)}, {state(4, 0, 15, 5, 7), state(3, 1, 15, 5)}};
  for (size_t pair = 0; pair < 2; ++pair) {
    all.scenes_of_pairs.push_back({.removed = all.pairs[pair].hidden.user});
    for (size_t walls = 0; walls < 2; ++walls) {
      for (size_t i = 0; i < kCornerCases; ++i) {
        for (size_t policy = 0; policy < 2; ++policy) {
          const bool is_hidden = i == 0, is_empty = i == 2;
          // The second pair's first policy ends a second after the reveal.
          const int32_t steps = pair == 1 && policy == 0 && is_hidden ? 30 : kTakeoverSteps;
          all.takeovers.push_back(run_of(policy == 1 && is_hidden ? 7 : 5, steps, is_empty ? -1 : 20));
        }
      }
    }
  }
  return all;
}

TEST(CornerResults, AreMeasuredAtTheReveal) {
  const CornerResults all = made_up_corners();
  const auto reveal = reveal_of(all, 0, true, CornerCase::hidden, 0);
  ASSERT_TRUE(reveal);
  EXPECT_EQ(reveal->step, 20);
  EXPECT_EQ(reveal->distance_m, 30);
  EXPECT_NEAR(reveal->corner_m, 20 - 10, 1e-5);
  EXPECT_NEAR(reveal->speed_mps, 3, 1e-5);
  EXPECT_NEAR(reveal->approach_mps, 4, 1e-5);
  ASSERT_TRUE(reveal->deceleration_mps2);
  EXPECT_NEAR(*reveal->deceleration_mps2, 1, 1e-5);
  EXPECT_FALSE(reveal_of(all, 1, true, CornerCase::hidden, 0)->deceleration_mps2) << "it ended before 2 s were over";
  const auto empty = reveal_of(all, 0, true, CornerCase::empty, 0);
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->step, 20) << "the time of its pair";
  EXPECT_FALSE(empty->distance_m);
  EXPECT_NEAR(empty->corner_m, 10.5, 1e-5);
}

TEST(CornerResults, DifferencesAreTakenWithinPairs) {
  const CornerResults all = made_up_corners();
  const std::vector<CornerRow> rows = summarize(all);
  ASSERT_EQ(rows.size(), 2u * (6 + 3 + 4));
  EXPECT_EQ(rows[0].revealed, 2);
  EXPECT_EQ(rows[0].ended_early, 1);
  EXPECT_EQ(rows[0].driving[29], 2);
  EXPECT_EQ(rows[0].driving[30], 1) << "runs that have ended are left out";
  EXPECT_NEAR(rows[0].speed_mps[10].value, 4, 1e-5);
  EXPECT_EQ(rows[0].reveal_s[1], 2);
  const auto find = [&rows](size_t policy, std::optional<size_t> less_policy, std::optional<CornerCase> less_case) {
    for (const CornerRow& row : rows) {
      if (row.its_case == CornerCase::hidden && row.policy == policy && row.less_policy == less_policy &&
          row.less_case == less_case) {
        return row;
      }
    }
    throw Error("no such row");
  };
  EXPECT_NEAR(find(1, 0, {}).at_reveal.speed_mps.value, 2, 1e-5);
  EXPECT_EQ(find(1, 0, {}).scenes, 2);
  // The first policy drives as if no vehicle were there: no paired difference.
  EXPECT_EQ(find(0, {}, CornerCase::removed).at_reveal.speed_mps.value, 0);
  EXPECT_EQ(find(0, {}, CornerCase::removed).at_reveal.approach_mps.value, 0);
  EXPECT_EQ(find(0, {}, CornerCase::removed).at_reveal.speed_mps.half_width_95, 0);
  EXPECT_NEAR(find(1, {}, CornerCase::removed).at_reveal.speed_mps.value, 2, 1e-5);
}

TEST(CornerResults, AreWrittenPerRun) {
  const test::ScratchFolder folder;
  const CornerResults all = made_up_corners();
  write_corner_cases(folder / "cases.csv", all);
  const auto table = read_table(folder / "cases.csv");
  ASSERT_EQ(table.size(), 1u + 2 * 2 * 3 * 2);
  ASSERT_EQ(table[0].size(), 24u + kTakeoverSteps + 1);
  EXPECT_EQ(table[0][11], "removed");
  EXPECT_EQ(table[1][11], "-1");
  EXPECT_EQ(table[3][11], "7");
  EXPECT_EQ(table[0][20], "reveal_corner_m");
  EXPECT_EQ(table[1][20], "10.000");
  EXPECT_EQ(table[1][16], "2.1");
  EXPECT_EQ(table[13][23], "") << "no deceleration of a run that ended";
  EXPECT_EQ(table[13][23 + 30], "2.100");
  EXPECT_EQ(table[13][23 + 31], "") << "it has ended";

  const auto json = nlohmann::json::parse(corner_summary_json(all, summarize(all), "cases.csv"));
  EXPECT_EQ(json.at("kind"), "corner");
  EXPECT_EQ(json.at("control"), "none");
  EXPECT_EQ(json.at("pairs"), 2);
  EXPECT_EQ(json.at("cases"), 24);
  EXPECT_EQ(json.at("rows")[0].at("driving")[30], 1);
  EXPECT_EQ(json.at("rows")[0].at("ended_early"), 1);
  EXPECT_EQ(json.at("rows")[6].at("less_policy"), "one");
  EXPECT_TRUE(json.at("rows")[0].at("less_policy").is_null());
}

}  // namespace
}  // namespace pictura
