// The probe of counterfactual removal: controls that could fail, and means.
#include "pictura/evaluation/probes/removal.h"

#include <cmath>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "pictura/common/support/file.h"
#include "pictura/policy/session.h"
#include "pictura/tests/evaluation/probed_policies.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::kAgent;
using test::kLikeForLike;
using test::kVectorized;
using test::message_of;
using test::read_table;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct RemovalKind {
  using Options = RemovalOptions;
  using Results = RemovalResults;
  static constexpr int64_t kCases = 600;
  static void set_cases(int64_t cases, RemovalOptions* options) { options->removals = cases; }
  static RemovalResults probe(const RemovalOptions& options) { return probe_removal(options); }
  static bool is_same(const RemovalResults& a, const RemovalResults& b) { return test::same_bits(a, b); }
};
using Removal = test::ProbeTest<RemovalKind>;

TEST_F(Removal, EachPolicyDrivesAnEqualShareOfTheScenes) {
  const RemovalResults& all = results();
  ASSERT_EQ(all.cases.size(), 600u);
  ASSERT_EQ(all.responses.size(), 3 * all.cases.size());
  EXPECT_EQ(all.policies[kAgent].name, "agent");
  EXPECT_EQ(all.policies[kLikeForLike].name, "like_for_like");
  EXPECT_TRUE(all.policies[kAgent].reads_images);
  std::map<int, int> of_scene;
  std::set<std::tuple<int, int, int, int>> pairs;
  for (const RemovalCase& one : all.cases) {
    ++of_scene[one.scene];
    EXPECT_TRUE(pairs.insert({one.scene, one.step, one.ego, one.user}).second) << "none is drawn twice";
    EXPECT_EQ(one.driver, (one.scene - 3) / 2);
    EXPECT_EQ(one.map, one.scene % 2);
    EXPECT_EQ(one.step % 4, 0);
    EXPECT_GT(one.step, 0);
    EXPECT_NE(one.ego, one.user);
    EXPECT_EQ(one.hidden, one.user);
    EXPECT_LE(one.distance_m, 50);
    EXPECT_TRUE(!one.is_in_frame() || (one.visible_share >= 0 && one.visible_share <= 1));
  }
  ASSERT_EQ(of_scene.size(), 6u);
  for (const auto& [scene, count] : of_scene) EXPECT_NEAR(count, 600 / 6.0, 1) << scene;
  for (const PairedResponse& one : all.responses) {
    EXPECT_TRUE(std::isfinite(one.value) && std::isfinite(one.value_without));
    EXPECT_TRUE(one.brake > 0 && one.brake < 1 && one.brake_without > 0 && one.brake_without < 1);
  }
}

TEST_F(Removal, UnseenAgentsChangeNothingForCamerasAndMuchForVectors) {
  const RemovalResults& all = results();
  int hidden = 0, outside = 0, visible = 0, seen_changes = 0;
  std::array<int, 3> unseen_changes{};
  for (size_t i = 0; i < all.cases.size(); ++i) {
    const RemovalCase& one = all.cases[i];
    const bool is_unseen = !one.is_in_frame() || one.visible_share == 0;
    hidden += one.is_in_frame() && one.visible_share == 0;
    outside += !one.is_in_frame();
    for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
      if (is_unseen) unseen_changes[policy] += !all.response(i, policy).is_unchanged();
    }
    if (one.is_in_frame() && one.visible_share > 0.5f && one.distance_m < 20) {
      ++visible;
      seen_changes += !all.response(i, kAgent).is_unchanged();
    }
  }
  ASSERT_GT(hidden, 20) << "behind walls and vehicles";
  EXPECT_EQ(unseen_changes[kAgent], 0);
  EXPECT_GT(unseen_changes[kVectorized], hidden / 2);
  EXPECT_GT(unseen_changes[kLikeForLike], hidden / 2);
  ASSERT_GT(visible, 20);
  EXPECT_GT(seen_changes, 9 * visible / 10);
  RecordProperty("outside", outside);
}

TEST_F(Removal, HidingObservedPartnersChangesVectorPolicies) {
  const RemovalResults& all = results();
  int near = 0;
  std::array<int, 3> changed{};
  for (size_t i = 0; i < all.cases.size(); ++i) {
    if (all.cases[i].distance_m > 10) continue;
    ++near;
    for (const size_t policy : {kVectorized, kLikeForLike}) changed[policy] += !all.response(i, policy).is_unchanged();
  }
  ASSERT_GT(near, 10);
  // Some partners have no feature that is the largest of its set, so that no policy responds to their removal.
  EXPECT_GT(changed[kVectorized], near * 3 / 4);
  EXPECT_GT(changed[kLikeForLike], near * 3 / 4);
}

TEST_F(Removal, HidingNoAgentChangesNothing) {
  const RemovalResults control = controlled(RemovalControl::unchanged);
  ASSERT_EQ(control.cases.size(), 600u);
  for (const RemovalCase& one : control.cases) EXPECT_EQ(one.hidden, -1);
  for (size_t i = 0; i < control.responses.size(); ++i) {
    const PairedResponse &with = results().responses[i], &without = control.responses[i];
    EXPECT_TRUE(without.is_unchanged()) << i;
    EXPECT_EQ(without.value, with.value) << "the states are the same " << i;
  }
}

TEST_F(Removal, HidingAnotherUserGivesOtherNumbers) {
  const RemovalResults control = controlled(RemovalControl::permuted);
  ASSERT_EQ(control.cases.size(), results().cases.size());
  int others = 0, differ = 0;
  for (size_t i = 0; i < control.cases.size(); ++i) {
    const RemovalCase &one = control.cases[i], &same = results().cases[i];
    EXPECT_EQ(one.user, same.user);
    EXPECT_TRUE(one.visible_share == same.visible_share || !one.is_in_frame());
    EXPECT_NE(one.hidden, one.user);
    if (one.hidden < 0) continue;
    ++others;
    differ += control.response(i, kVectorized).value_without != results().response(i, kVectorized).value_without;
  }
  EXPECT_GT(others, 500);
  EXPECT_GT(differ, others * 9 / 10);
}

TEST_F(Removal, UntrainedPoliciesAreEvaluatedInTheSameStates) {
  const RemovalResults control = controlled(RemovalControl::untrained);
  const RemovalResults& all = results();
  ASSERT_EQ(control.cases.size(), all.cases.size());
  int hidden = 0, seen_changes = 0;
  std::array<int, 3> differ{}, hidden_changes{};
  for (size_t i = 0; i < control.cases.size(); ++i) {
    const RemovalCase &one = control.cases[i], &same = all.cases[i];
    EXPECT_EQ(std::tuple(one.scene, one.step, one.ego, one.user, one.hidden, one.ego_speed_mps),
              std::tuple(same.scene, same.step, same.ego, same.user, same.hidden, same.ego_speed_mps))
        << "the trained policies drive";
    const bool is_hidden = one.is_in_frame() && one.visible_share == 0;
    hidden += is_hidden;
    for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
      differ[policy] += control.response(i, policy).value != all.response(i, policy).value;
      hidden_changes[policy] += is_hidden && !control.response(i, policy).is_unchanged();
    }
    seen_changes += one.visible_share > 0.5f && !control.response(i, kAgent).is_unchanged();
  }
  for (const size_t policy : {kAgent, kVectorized, kLikeForLike}) {
    EXPECT_GT(differ[policy], 590) << policy;
    EXPECT_NE(control.policies[policy].untrained_hash, control.policies[policy].hash);
    EXPECT_EQ(control.policies[policy].hash, all.policies[policy].hash);
    EXPECT_EQ(all.policies[policy].untrained_hash, "");
  }
  EXPECT_EQ(hidden_changes[kAgent], 0) << "no weights see through walls";
  EXPECT_GT(hidden_changes[kVectorized], hidden / 2);
  EXPECT_GT(seen_changes, 20);
  EXPECT_EQ(control.policies[kVectorized].untrained_hash, control.policies[kLikeForLike].untrained_hash)
      << "one architecture, one seed";
  EXPECT_EQ(control.policies[kAgent].responding_name(), "untrained agent");
  const auto json = nlohmann::json::parse(removal_summary_json(control, summarize(control), ""));
  EXPECT_EQ(json.at("control"), "untrained");
  EXPECT_EQ(json.at("policy")[0].at("untrained_hash"), control.policies[kAgent].untrained_hash);
}

TEST_F(Removal, SeedsDetermineWeightsOfUntrainedPolicies) {
  const PolicySession trained(policies_[kAgent], {.num_threads = 1, .device = "cpu"});
  const auto hash_of = [&](uint64_t seed) { return trained.make_untrained(seed)->policy_hash(); };
  EXPECT_EQ(hash_of(1), hash_of(1));
  EXPECT_NE(hash_of(1), hash_of(2));
  EXPECT_EQ(trained.make_untrained(1)->training_world().walls, trained.training_world().walls);
}

TEST_F(Removal, BatchSizeDoesNotChangeResults) { expect_the_same_of_batches({1, 300}); }

TEST_F(Removal, SeedsDetermineTheCases) { EXPECT_EQ(expect_seeds_to_decide(30).cases.size(), 30u); }

TEST_F(Removal, PoliciesOfVectorsNeedNoImages) {
  RemovalOptions o = options(60);
  o.policies = {policies_[kLikeForLike], policies_[kLikeForLike]};
  o.worlds.scenarios = 2;
  o.worlds.steps = 30;
  const RemovalResults one = probe(o);
  EXPECT_EQ(one.cases.size(), 60u);
  EXPECT_FALSE(one.policies[0].reads_images);
  EXPECT_THAT(one.policies[1].name, ::testing::EndsWith("like_for_like/checkpoint.ckpt (2)"));
  for (size_t i = 0; i < one.cases.size(); ++i) {
    EXPECT_EQ(one.response(i, 0).value_without, one.response(i, 1).value_without) << "the same policy";
  }
  EXPECT_TRUE(std::any_of(one.cases.begin(), one.cases.end(), [](const RemovalCase& c) { return c.is_in_frame(); }));
}

TEST_F(Removal, RefusesInvalidOptions) {
  RemovalOptions o = options(10);
  o.worlds.scenarios = 4;
  EXPECT_THAT(message_of([&] { probe(o); }), HasSubstr("divisible among 3 policies, got 4"));
  o = options(10);
  o.sample_steps = 60;
  EXPECT_THAT(message_of([&] { probe(o); }), HasSubstr("every 1 to 59 steps, got 60"));
  o = options(10);
  o.policies = {*folder_ / "no.ckpt", *folder_ / "no.ckpt"};
  EXPECT_THAT(message_of([&] { probe(o); }), HasSubstr("no.ckpt"));
  EXPECT_EQ(default_probe_scenes(3, 8), 24);
  EXPECT_EQ(default_probe_scenes(2, 8), 16);
  EXPECT_EQ(default_probe_scenes(1, 8), 16);
}

/// Cases of two scenes, with changes that are defined here.
RemovalResults made_up_removals() {
  RemovalResults all;
  all.setting.maps = {"a \"b\""};
  all.policies = {{"one", "one.ckpt", "h", true}, {"two", "two.ckpt", "i", false}};
  all.scenes = 2;
  all.range_m = 50;
  const auto add = [&all](int scene, float visible_share, float distance_m, float d_value) {
    all.cases.push_back({.scene = scene, .hidden = 5, .distance_m = distance_m, .visible_share = visible_share});
    all.responses.push_back({1 + d_value, 1, 0.5f, 0.25f});
    all.responses.push_back({1, 1, 0.25f, 0.25f});
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  add(0, 1, 5, 1);       // whole: |dV| 1
  add(0, 0.97f, 6, -3);  // in the same bin: 3; the scene's mean is 2
  add(1, 1, 45, 4);      // 4: the mean of both scenes is 3
  add(0, 0, 12, 0.5f);   // hidden
  add(1, nan, 12, 2);    // in no frame
  return all;
}

const RemovalRow& row_of(const std::vector<RemovalRow>& rows, int policy, int bin, std::optional<int> band = {}) {
  for (const RemovalRow& row : rows) {
    if (row.policy == policy && row.group.occlusion_bin == bin && row.group.distance_band == band) return row;
  }
  throw Error("no such row");
}

TEST(RemovalResults, MeansAreOverScenes) {
  const std::vector<RemovalRow> rows = summarize(made_up_removals());
  EXPECT_EQ(rows.size(), 2u * 6 * 12);
  const RemovalRow& whole = row_of(rows, 0, 0);
  EXPECT_EQ(whole.cases, 3);
  EXPECT_EQ(whole.scenes, 2);
  EXPECT_DOUBLE_EQ(whole.abs_value_change.value, 3);
  // The scenes' means are 2 and 4: the standard deviation is sqrt(2), that of the mean 1.
  EXPECT_NEAR(whole.abs_value_change.half_width_95, 1.96, 1e-9);
  EXPECT_DOUBLE_EQ(whole.value_change.value, (-1 + 4) / 2.0);
  EXPECT_DOUBLE_EQ(whole.abs_brake_change.value, 0.25);
  EXPECT_NEAR(whole.mean_occlusion, 0.01, 1e-6);
  EXPECT_EQ(whole.changed_share.value, 1);
  EXPECT_EQ(row_of(rows, 1, 0).changed_share.value, 0);
  EXPECT_EQ(row_of(rows, 1, 0).abs_brake_change.value, 0);
  EXPECT_EQ(row_of(rows, 0, RemovalGroup::kOcclusionBins).abs_value_change.value, 0.5);
  EXPECT_EQ(row_of(rows, 0, -1).abs_value_change.value, 2) << "in no frame is no occlusion of 100 %";
  EXPECT_EQ(row_of(rows, 0, 0, 0).cases, 2);
  EXPECT_EQ(row_of(rows, 0, 0, 4).cases, 1);
  EXPECT_EQ(row_of(rows, 0, RemovalGroup::kOcclusionBins, 1).cases, 1);
  EXPECT_EQ(row_of(rows, 0, 5).cases, 0);
  EXPECT_TRUE(std::isinf(row_of(rows, 0, 5).abs_value_change.value));
}

TEST(RemovalResults, AreWrittenPerCase) {
  const test::ScratchFolder folder;
  const RemovalResults all = made_up_removals();
  write_removal_cases(folder / "cases.csv", all);
  const std::string text = read_file(folder / "cases.csv");
  EXPECT_THAT(text, StartsWith("case,scene,map,driver,step,ego,user,hidden,class,halted,distance_m"));
  EXPECT_THAT(text, HasSubstr("\"a \"\"b\"\"\""));
  const auto table = read_table(folder / "cases.csv");
  ASSERT_EQ(table.size(), 6u);
  ASSERT_EQ(table[0].size(), table[1].size());
  EXPECT_EQ(table[0][14], "\"one/value\"");
  EXPECT_EQ(table[1][14], "2");
  EXPECT_EQ(table[1][15], "1");
  EXPECT_EQ(table[5][12], "0");
  EXPECT_EQ(table[5][13], "");

  const auto json = nlohmann::json::parse(removal_summary_json(all, summarize(all), "cases.csv"));
  EXPECT_EQ(json.at("kind"), "removal");
  EXPECT_EQ(json.at("cases"), 5);
  EXPECT_EQ(json.at("cases_file"), "cases.csv");
  EXPECT_EQ(json.at("policy")[1].at("name"), "two");
  const auto& row = json.at("rows")[0];
  EXPECT_EQ(row.at("group"), "0-10 %");
  EXPECT_EQ(row.at("abs_d_value"), 3);
  EXPECT_TRUE(row.at("distance_from_m").is_null());
  EXPECT_TRUE(json.at("rows")[5].at("abs_d_value").is_null()) << "no cases";
}

}  // namespace
}  // namespace pictura
