// Whole training runs with a few vehicles on the procedural town: files, exact resumption, interrupts and evaluation.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <unistd.h>

#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/configuration/compare_configs.h"
#include "pictura/driving/world.h"
#include "pictura/evaluation/evaluate.h"
#include "pictura/map/load_map.h"
#include "pictura/policy/layers.h"
#include "pictura/policy/observation.h"
#include "pictura/policy/session.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/missing_renderer.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/run.h"
#include "pictura/training/run_folder.h"

namespace pictura {
namespace {

using test::message_of;
using test::one_scenario;
using test::read_table;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Training : public ::testing::Test {
 protected:
  TrainOptions options(const std::string& run, const std::vector<std::string>& more = {}) const {
    return test::small_run(folder_ / run, "cpu", more);
  }
  test::ScratchFolder folder_;
};

TEST_F(Training, ResumesExactly) {
  const TrainReport whole = train(options("whole"));
  EXPECT_EQ(whole.updates, 4);
  EXPECT_GT(whole.agent_steps, 0);

  const TrainReport half = train(options("parts", {"train.updates=2"}));
  EXPECT_NE(half.policy_hash, whole.policy_hash);
  TrainOptions rest = options("parts");
  rest.old_run = OldRun::resume;
  const TrainReport resumed = train(rest);
  EXPECT_EQ(resumed.policy_hash, whole.policy_hash);
  EXPECT_EQ(resumed.agent_steps, whole.agent_steps);
  EXPECT_EQ(resumed.km_driven, whole.km_driven);
  ASSERT_TRUE(std::isfinite(whole.episode_return));
  EXPECT_EQ(resumed.episode_return, whole.episode_return);

  // One row per update, each once, after the head; except for the clock every number equals that of the uninterrupted
  // run.
  const std::vector<std::vector<std::string>> parts = read_table(folder_ / "parts/progress.csv"),
                                              all = read_table(folder_ / "whole/progress.csv");
  ASSERT_EQ(parts.size(), 5u);
  ASSERT_EQ(all.size(), 5u);
  for (size_t row = 0; row < parts.size(); ++row) {
    EXPECT_EQ(parts[row][0], row == 0 ? "update" : std::to_string(row));
    ASSERT_EQ(parts[row].size(), parts[0].size());
    for (size_t column = 0; column < parts[row].size(); ++column) {
      const std::string& name = parts[0][column];
      if (name.starts_with("time/") || name == "charts/agent_steps_per_s") continue;
      EXPECT_EQ(parts[row][column], all[row][column]) << name << " of row " << row;
    }
  }
}

TEST_F(Training, StopsAtItsTimeLimitAndResumesExactly) {
  const TrainReport half = train(options("parts", {"train.updates=2"}));
  EXPECT_FALSE(half.out_of_time);
  // Out of time before the first remaining update.
  TrainOptions rest = options("parts");
  rest.old_run = OldRun::resume;
  rest.minutes = 1e-9;
  bool has_begun = false;
  rest.on_progress = [&has_begun](const TrainProgress&) { has_begun = true; };
  const TrainReport stopped = train(rest);
  EXPECT_TRUE(stopped.out_of_time);
  EXPECT_FALSE(stopped.interrupted);
  EXPECT_FALSE(has_begun);
  EXPECT_EQ(stopped.updates, 2);
  EXPECT_EQ(stopped.agent_steps, half.agent_steps);
  EXPECT_EQ(stopped.policy_hash, half.policy_hash);
  rest.minutes = 60;
  const TrainReport resumed = train(rest), whole = train(options("whole"));
  EXPECT_FALSE(resumed.out_of_time);
  EXPECT_EQ(resumed.updates, 4);
  EXPECT_EQ(resumed.policy_hash, whole.policy_hash);
  EXPECT_EQ(resumed.agent_steps, whole.agent_steps);
  EXPECT_EQ(read_table(folder_ / "parts/progress.csv").size(), 5u);
}

TEST_F(Training, UsesSavedUpdateTimesOfTheSameDeviceAndAgentCount) {
  const TrainReport first = train(options("run", {"train.updates=1"}));
  Checkpoint saved = read_checkpoint(first.checkpoint);
  ASSERT_EQ(saved.longest_update_s.size(), 1u);
  EXPECT_EQ(saved.longest_update_s.begin()->first, "host, 8 agents");
  EXPECT_GT(saved.longest_update_s.begin()->second, 0);
  const auto resume = [&](const char* updates) {
    TrainOptions rest = options("run", {updates});
    rest.old_run = OldRun::resume;
    rest.minutes = 60;
    return train(rest);
  };
  // An update of an hour does not end within an hour; durations elsewhere, or with more agents, do not count.
  const std::map<std::string, double> elsewhere{{"NVIDIA H100, 8 agents", 3600}, {"host, 80 agents", 3600}};
  saved.longest_update_s = elsewhere;
  saved.longest_update_s["host, 8 agents"] = 3600;
  write_checkpoint(first.checkpoint, saved);
  const TrainReport stopped = resume("train.updates=2");
  EXPECT_TRUE(stopped.out_of_time);
  EXPECT_EQ(stopped.updates, 1);
  EXPECT_EQ(read_checkpoint(first.checkpoint).longest_update_s, saved.longest_update_s);
  saved.longest_update_s = elsewhere;
  write_checkpoint(first.checkpoint, saved);
  EXPECT_EQ(resume("train.updates=2").updates, 2);
  std::map<std::string, double> measured = read_checkpoint(first.checkpoint).longest_update_s;
  EXPECT_GT(measured["host, 8 agents"], 0);
  EXPECT_LT(measured["host, 8 agents"], 3600);
  measured.erase("host, 8 agents");
  EXPECT_EQ(measured, elsewhere);
}

TEST_F(Training, ARunWithoutTimeForItsFirstUpdateIsSavedAndResumes) {
  TrainOptions none = options("run", {"train.updates=1"});
  none.minutes = 1e-9;
  const TrainReport stopped = train(none);
  EXPECT_TRUE(stopped.out_of_time);
  EXPECT_EQ(stopped.updates, 0);
  EXPECT_EQ(stopped.agent_steps, 0);
  for (const char* name : {"config.toml", "untrained.ckpt", "checkpoint.ckpt", "policy.safetensors"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / (std::string("run/") + name))) << name;
  }
  TrainOptions rest = options("run", {"train.updates=1"});
  rest.old_run = OldRun::resume;
  EXPECT_EQ(train(rest).policy_hash, train(options("whole", {"train.updates=1"})).policy_hash);
}

TEST_F(Training, NewEpisodesReplaceUnreadableSimulatorStates) {
  const TrainReport half = train(options("run", {"train.updates=2"}));
  const Checkpoint saved = read_checkpoint(half.checkpoint);
  const auto resume = [&](std::vector<uint8_t> simulator, const char* updates, std::vector<std::string>* notices) {
    Checkpoint changed = saved;
    changed.simulator = std::move(simulator);
    write_checkpoint(half.checkpoint, changed);
    TrainOptions o = options("run", {updates});
    o.old_run = OldRun::resume;
    o.on_notice = [notices](const std::string& notice) { notices->push_back(notice); };
    return train(o);
  };
  std::vector<uint8_t> truncated = saved.simulator, of_other_kind = saved.simulator;
  truncated.resize(truncated.size() / 2);
  of_other_kind[0] ^= 0xFF;
  for (const std::vector<uint8_t>& simulator : {truncated, of_other_kind, std::vector<uint8_t>{}}) {
    std::vector<std::string> notices;
    const TrainReport nothing_more = resume(simulator, "train.updates=2", &notices);
    ASSERT_EQ(notices.size(), 1u);
    EXPECT_THAT(notices[0], AllOf(HasSubstr("new episodes begin"), HasSubstr("simulator state: ")));
    EXPECT_EQ(nothing_more.policy_hash, half.policy_hash);
    EXPECT_EQ(nothing_more.updates, 2);
    EXPECT_EQ(nothing_more.agent_steps, half.agent_steps);
    EXPECT_EQ(nothing_more.km_driven, half.km_driven);
    const Checkpoint kept = read_checkpoint(half.checkpoint);
    EXPECT_EQ(kept.adam_steps, saved.adam_steps);
    EXPECT_EQ(kept.filter_average, saved.filter_average);
    EXPECT_EQ(kept.recent.size(), saved.recent.size());
    EXPECT_NE(kept.simulator, saved.simulator);
  }
  std::vector<std::string> notices;
  const TrainReport resumed = resume(truncated, "train.updates=4", &notices);
  EXPECT_EQ(notices.size(), 1u);
  EXPECT_EQ(resumed.updates, 4);
  EXPECT_GT(resumed.agent_steps, half.agent_steps);
  EXPECT_GT(resumed.km_driven, half.km_driven);
  EXPECT_EQ(read_table(folder_ / "run/progress.csv").size(), 5u);
  // Episodes that can continue do so without a notice.
  notices.clear();
  resume(saved.simulator, "train.updates=2", &notices);
  EXPECT_TRUE(notices.empty());
}

TEST_F(Training, ResumeErrorsNameOtherCameras) {
  auto write_rig = [&](double yaw_deg) {
    write_file(folder_ / "rig.toml", fmt::format("[[camera]]\nname = \"ahead\"\nwidth_px = 16\nheight_px = 9\n"
                                                 "focal_px = 8\nx_m = 1\nz_m = 1.5\nyaw_deg = {}\n",
                                                 yaw_deg));
    // The run's configuration must name the rig, without the sizes of smoke.toml.
    write_file(folder_ / "config.toml",
               "[simulator]\nmaps = [\"procedural\"]\nmax_agents = 8\npedestrian_fraction = 0\ncyclist_fraction = "
               "0\nwalls = false\nparked_cars = 0\n[render]\nrig = \"rig.toml\"\n"
               "[policy]\nbackbone_width = 32\n[train]\nminibatch_size = 64\nforward_chunk = 64\n");
  };
  write_rig(0);
  TrainOptions o = options("run", {"train.updates=1"});
  o.config_path = folder_ / "config.toml";
  std::erase_if(o.overrides, [](const std::string& text) { return text.starts_with("render."); });
  train(o);
  write_rig(10);
  o.old_run = OldRun::resume;
  o.overrides.push_back("train.updates=2");
  EXPECT_THAT(message_of([&] { train(o); }), AllOf(HasSubstr("checkpoint.ckpt"), HasSubstr("rig.toml"),
                                                   HasSubstr("'ahead'"), HasSubstr("yaw_pitch_roll_rad")));
  write_rig(0);
  EXPECT_EQ(train(o).updates, 2);
}

TEST_F(Training, ResumesWithRenamedRigsAndOtherHarmlessSettings) {
  const std::string camera =
      "[[camera]]\nname = \"ahead\"\nwidth_px = 16\nheight_px = 9\nfocal_px = 8\nx_m = 1\nz_m = 1.5\n";
  auto write_config = [&](const std::string& rig) {
    write_file(folder_ / rig, camera);
    write_file(folder_ / "config.toml",
               fmt::format("[simulator]\nmaps = [\"procedural\"]\nmax_agents = 8\nwalls = false\nparked_cars = 0\n"
                           "[render]\nrig = \"{}\"\n[policy]\nbackbone_width = 32\n"
                           "[train]\nminibatch_size = 64\nforward_chunk = 64\n",
                           rig));
  };
  write_config("rig.toml");
  TrainOptions o = options("run", {"train.updates=1"});
  o.config_path = folder_ / "config.toml";
  std::erase_if(o.overrides, [](const std::string& text) { return text.starts_with("render."); });
  train(o);
  write_config("renamed.toml");
  o.old_run = OldRun::resume;
  for (const char* text : {"train.updates=2", "run.device=cpu", "simulator.backend=cpu", "render.backend=cpu",
                           "evaluate.conditioning.delta_goal_m=3"}) {
    o.overrides.push_back(text);
  }
  EXPECT_EQ(train(o).updates, 2);
}

TEST_F(Training, EachRendererWorksWithTheSimulatorOnTheCpu) {
  const TrainReport black = train(options("null", {"train.updates=1", "render.backend=null"}));
  EXPECT_EQ(black.renderer, "null");
  EXPECT_EQ(black.simulator, "cpu");
  EXPECT_EQ(black.device, "cpu");
  const TrainReport drawn = train(options("cpu", {"train.updates=1"}));
  EXPECT_NE(black.policy_hash, drawn.policy_hash);
  // The old key has the same effect.
  TrainOptions old = options("old", {"train.updates=1", "run.backend=null"});
  std::erase(old.overrides, "render.backend=cpu");
  EXPECT_EQ(train(old).policy_hash, black.policy_hash);
  if (const std::string why = missing("gl:osmesa"); !why.empty()) GTEST_SKIP() << why;
  const TrainReport gl = train(options("gl", {"train.updates=1", "render.backend=gl:osmesa", "render.samples=2x2"}));
  EXPECT_THAT(gl.renderer, HasSubstr("gl"));
  EvaluateOptions o = one_scenario(gl.checkpoint, 3);
  o.agents_per_world = 4;
  o.argmax = false;
  EXPECT_GT(evaluate(o).rows.at(0).km_driven, 0);
}

TEST_F(Training, OversizedRolloutsAreRefused) {
  // 65,537 rows of 8,000 observations: about 2.8 TB for vectors, far more for large images.
  const std::vector<std::string> huge = {"train.num_steps=65536", "simulator.num_slots=8000"};
  TrainOptions vector = options("vector", huge);
  vector.overrides.push_back("policy.modality=vector");
  EXPECT_THAT(message_of([&] { train(vector); }),
              AllOf(HasSubstr("simulator.num_slots"), HasSubstr("train.num_steps"), HasSubstr("GB")));
  TrainOptions images = options("images", huge);
  images.overrides.push_back("render.width_px=256");
  EXPECT_THAT(message_of([&] { train(images); }), HasSubstr("simulator.num_slots"));
}

TEST_F(Training, ARolloutKeepsTheObservationsOfActiveAgents) {
  // With randomized cameras, whose images are the same when drawn again.
  const auto config_of = [](std::vector<std::string> more) {
    more.insert(more.end(),
                {"run.num_threads=1", "render.backend=cpu", "train.num_steps=3", "render.randomization.rotation_deg=5",
                 "render.randomization.noise_share=0.1", "render.randomization.dropped_probability=0.2"});
    return load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", more);
  };
  const Config kept = config_of({"train.images=kept"}), redrawn = config_of({"train.images=redrawn"}),
               held = config_of({"train.images=kept", "policy.decision_steps=3"});
  const std::unique_ptr<Simulator> simulator =
      make_simulator("cpu", simulator_config(kept), {load_map("procedural")}, draw_worlds(1, 24, 8, 8, 1));
  const Rig rig = rig_of(kept);
  const std::unique_ptr<Renderer> renderer = make_renderer("cpu", renderer_config(kept, rig));
  upload_maps(*simulator, renderer.get());
  const std::unique_ptr<LearnerExecutor> executor = make_learner_executor(Device{});
  RolloutObservations all[] = {{kept, simulator.get(), renderer.get(), nullptr},
                               {redrawn, simulator.get(), renderer.get(), nullptr},
                               // It has room for a decision every three steps, and receives one at every step.
                               {held, simulator.get(), renderer.get(), nullptr}};
  const uint64_t generation = all[2].generation();
  simulator->reset();
  // Full throttle and full lock: some agents leave the road, some of them earlier than others.
  std::vector<int32_t> actions(24);
  for (size_t i = 0; i < actions.size(); ++i) actions[i] = static_cast<int32_t>(i) % kNumActions;
  std::vector<at::Tensor> rows;
  std::vector<uint8_t> seen;  // images of the rows
  std::vector<float> egos;
  for (int64_t step = 0; step < 4; ++step) {
    const SimulatorArrays input = simulator->arrays();
    const at::Tensor slots = active_slots(input, {}, false, executor.get());
    for (RolloutObservations& observations : all) observations.record(step, slots);
    rows.push_back(slots + step * 24);
    HostImages images(rig, 24);
    renderer->render(input.scene, input.views, images.batch());
    const size_t image_bytes = images.bytes().size() / 24;
    for (int64_t i = 0; i < slots.size(0); ++i) {
      const auto slot = static_cast<size_t>(slots[i].item<int64_t>());
      const uint8_t* const first = images.bytes().data() + slot * image_bytes;
      seen.insert(seen.end(), first, first + image_bytes);
      const float* const ego = input.observations.ego.data() + slot * kEgoFeatures;
      egos.insert(egos.end(), ego, ego + kEgoFeatures);
    }
    for (int i = 0; i < 20; ++i) simulator->step(actions);
  }
  ASSERT_LT(rows.back().size(0), 24) << "some have halted";
  ASSERT_GT(rows.back().size(0), 0);
  EXPECT_EQ(all[0].generation(), generation);
  EXPECT_GT(all[2].generation(), generation) << "its memory has moved";
  const at::Tensor in_order = at::cat(rows), mixed = at::arange(in_order.size(0) - 1, -1, -1, at::kLong);
  for (const RolloutObservations& observations : all) {
    const Observation saw = observations.gather(in_order),
                      mixed_saw = observations.gather(in_order.index_select(0, mixed));
    ASSERT_EQ(static_cast<size_t>(saw.images.at(0).pixels.numel()), seen.size());
    EXPECT_EQ(0, std::memcmp(saw.images[0].pixels.const_data_ptr<uint8_t>(), seen.data(), seen.size()));
    EXPECT_EQ(0, std::memcmp(saw.ego.const_data_ptr<float>(), egos.data(), egos.size() * sizeof(float)));
    EXPECT_TRUE(mixed_saw.images[0].pixels.equal(saw.images[0].pixels.index_select(0, mixed)));
    EXPECT_TRUE(mixed_saw.ego.equal(saw.ego.index_select(0, mixed)));
    for (const int patch_px : {4, 8, 12, 16}) {
      const at::Tensor pixels = observations.gather(in_order, patch_px).images.at(0).pixels;
      if (observations.keep_images()) {
        EXPECT_TRUE(pixels.equal(saw.images[0].pixels)) << "kept as they are";
        continue;
      }
      EXPECT_TRUE(pixels.transpose(0, 1).is_contiguous());
      EXPECT_TRUE(pixels.transpose(0, 1)
                      .flatten(0, 1)
                      .permute({0, 3, 1, 2})
                      .equal(image_patches(saw.images[0].pixels, patch_px, at::kBFloat16)))
          << patch_px;
    }
  }
}

TEST_F(Training, KeptAndRedrawnImagesTrainEqualPolicies) {
  const TrainReport kept = train(options("kept", {"train.images=kept"}));
  EXPECT_EQ(train(options("redrawn", {"train.images=redrawn"})).policy_hash, kept.policy_hash);
}

TEST_F(Training, DrawnHaltedSlotsDoNotAffectLearning) {
  // Only gradients change parameters, by as much.
  const std::vector<std::string> settings = {
      "train.updates=1",  "train.num_steps=60",    "train.adv_filter_threshold=0", "simulator.num_slots=24",
      "train.adam_eps=1", "train.learning_rate=1", "train.update_epochs=1",        "train.schedule=constant"};
  const auto learn = [&](const std::string& halted_slots, int64_t minibatch_size, UpdateCost* cost_out) {
    TrainOptions o = options(fmt::format("{} {}", halted_slots, minibatch_size), settings);
    o.overrides.push_back("train.halted_slots=" + halted_slots);
    o.overrides.push_back(fmt::format("train.minibatch_size={}", minibatch_size));
    o.on_progress = [cost_out](const TrainProgress& progress) { *cost_out = progress.cost; };
    return read_checkpoint(train(o).checkpoint).parameters;
  };
  UpdateCost skipped, drawn, in_minibatches;
  const std::vector<NamedTensor> without = learn("skip", 4096, &skipped), with = learn("draw", 4096, &drawn);
  ASSERT_LT(skipped.agent_steps, skipped.slot_steps) << "some have halted";
  EXPECT_EQ(drawn.agent_steps, skipped.agent_steps);
  EXPECT_EQ(drawn.kept_fraction, 1);
  const std::vector<NamedTensor> before = read_checkpoint(folder_ / "skip 4096/untrained.ckpt").parameters;
  double learnt = 0;
  ASSERT_EQ(with.size(), without.size());
  for (size_t i = 0; i < with.size(); ++i) {
    EXPECT_LT((with[i].value - without[i].value).abs().max().item<double>(), 1e-5) << with[i].name;
    learnt = std::max(learnt, (with[i].value - before[i].value).abs().max().item<double>());
  }
  EXPECT_GT(learnt, 1e-3);
  // Halted agents are part of the minibatches.
  learn("draw", 64, &in_minibatches);
  EXPECT_EQ(in_minibatches.minibatches, (24 * 60 + 63) / 64);
}

TEST_F(Training, ImpairedAgentsAreExcludedFromLearning) {
  const auto learn = [&](const std::string& name, const std::vector<std::string>& more) {
    TrainOptions o =
        options(name, {"train.updates=1", "train.num_steps=60", "train.adv_filter_threshold=0", "train.update_epochs=1",
                       "train.minibatch_size=64", "simulator.num_slots=48", "simulator.reset_inactive_fraction=2"});
    o.overrides.insert(o.overrides.end(), more.begin(), more.end());
    UpdateCost cost;
    o.on_progress = [&cost](const TrainProgress& progress) { cost = progress.cost; };
    train(o);
    return cost;
  };
  const UpdateCost plain = learn("plain", {}),
                   among = learn("among", {"simulator.others.blind=0.2", "simulator.others.phantom_braking=0.2",
                                           "simulator.others.inattentive=0.1"});
  EXPECT_EQ(among.slot_steps, plain.slot_steps);
  EXPECT_NEAR(static_cast<double>(among.agent_steps) / static_cast<double>(plain.agent_steps), 0.5, 0.2);
  // Training uses all transitions of unimpaired agents, and no others.
  EXPECT_EQ(among.kept_fraction, 1);
  EXPECT_EQ(among.minibatches, (among.agent_steps + 63) / 64);
}

TEST_F(Training, ResumesExactlyWithImpairedAgents) {
  const std::vector<std::string> impaired{"simulator.others.blind=0.3", "simulator.others.phantom_braking=0.3"};
  const auto of = [&](const char* name, const char* updates) {
    TrainOptions o = options(name, impaired);
    o.overrides.emplace_back(updates);
    return o;
  };
  const TrainReport whole = train(of("whole", "train.updates=4"));
  train(of("parts", "train.updates=2"));
  TrainOptions rest = of("parts", "train.updates=4");
  rest.old_run = OldRun::resume;
  const TrainReport resumed = train(rest);
  EXPECT_EQ(resumed.policy_hash, whole.policy_hash);
  EXPECT_EQ(resumed.agent_steps, whole.agent_steps);
  rest.overrides.emplace_back("simulator.others.blind=0.1");
  EXPECT_THAT(message_of([&] { train(rest); }), HasSubstr("simulator.others.blind"));
}

TEST_F(Training, UpdatesReportTheirCost) {
  TrainOptions o = options("run", {"train.updates=2"});
  std::vector<UpdateCost> costs;
  o.on_progress = [&costs](const TrainProgress& progress) { costs.push_back(progress.cost); };
  const TrainReport report = train(o);
  ASSERT_EQ(costs.size(), 2u);
  EXPECT_EQ(costs[0].agent_steps + costs[1].agent_steps, report.agent_steps);
  for (const UpdateCost& cost : costs) {
    EXPECT_EQ(cost.slot_steps, 8 * 12);
    EXPECT_GT(cost.kept_fraction, 0);
    EXPECT_GT(cost.minibatches, 0);
    EXPECT_LT(std::abs(cost.first_kl), 1e-5) << "images and observations are those of the rollout";
    double phases_s = 0;
    for (size_t i = 0; i < kNumPhases; ++i) {
      EXPECT_GT(cost.phases_s[i], 0) << kPhaseNames[i];
      phases_s += cost.phases_s[i];
    }
    EXPECT_LT(phases_s, cost.rollout_s + cost.update_s);
  }
  EXPECT_EQ(report.device_bytes, 0) << "there is no device";
}

TEST_F(Training, WritesAllFilesAndStartsFromItsSeed) {
  const TrainReport report = train(options("run", {"train.updates=1"}));
  for (const char* name : {"config.toml", "untrained.ckpt", "checkpoint.ckpt", "policy.safetensors", "progress.csv"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / (std::string("run/") + name))) << name;
  }
  EXPECT_EQ(report.checkpoint, folder_ / "run/checkpoint.ckpt");
  const Config resolved = load_config(folder_ / "run/config.toml");
  EXPECT_EQ(resolved.train.updates, 1);
  EXPECT_EQ(resolved.render.width_px, 16);
  const TrainReport again = train(options("again", {"train.updates=1"}));
  EXPECT_EQ(again.policy_hash, report.policy_hash);
  const TrainReport other = train(options("other", {"train.updates=1", "run.seed=2"}));
  EXPECT_NE(other.policy_hash, report.policy_hash);
}

TEST_F(Training, InterruptedRunSavesAndResumesExactly) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  TrainOptions stopped = options("stopped");
  // The stopped process has its own scratch folder; it writes into the folder of the process that started it.
  constexpr const char* kFolder = "PICTURA_TEST_STOPPED_RUN";
  setenv(kFolder, stopped.out_folder.c_str(), /*overwrite=*/0);
  stopped.out_folder = std::getenv(kFolder);
  stopped.on_progress = [](const TrainProgress& progress) {
    if (progress.update == 2) std::raise(SIGINT);
  };
  // Runs in a separate process, since the interrupt flag is never reset.
  EXPECT_EXIT(
      {
        catch_interrupts();
        const TrainReport report = train(stopped);
        std::exit(report.interrupted && report.updates == 2 ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
  TrainOptions rest = options("stopped");
  rest.old_run = OldRun::resume;
  EXPECT_EQ(train(rest).policy_hash, train(options("whole")).policy_hash);
}

TEST_F(Training, AnExistingRunIsKeptUnlessOverwriteOrResumeIsSet) {
  const auto entries = [&] {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "run")) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  };
  const auto count_events = [&] {
    const std::vector<std::string> names = entries();
    return std::count_if(names.begin(), names.end(), [](const auto& name) { return name.starts_with("events.out."); });
  };
  train(options("run", {"train.updates=2"}));
  const std::vector<std::string> files = entries();
  const std::string events =
      *std::find_if(files.begin(), files.end(), [](const auto& name) { return name.starts_with("events."); });
  // Files of an earlier process and of another program, and files that belong to no run.
  write_file(folder_ / "run/events.out.tfevents.17.5", "old");
  write_file(folder_ / "run/.pictura-0123456789abcdef.tmp", "left by a killed process");
  write_file(folder_ / "run/notes.txt", "mine");
  write_file(folder_ / "run/events.out.tfevents.17.host", "another program's");

  const std::string checkpoint = read_file(folder_ / "run/checkpoint.ckpt");
  EXPECT_THAT(message_of([&] { train(options("run", {"train.updates=1"})); }),
              AllOf(HasSubstr((folder_ / "run") + ": already holds a run"), HasSubstr("checkpoint.ckpt, config.toml"),
                    HasSubstr(events), HasSubstr("progress.csv"), ::testing::Not(HasSubstr("notes.txt"))));
  EXPECT_EQ(read_file(folder_ / "run/checkpoint.ckpt"), checkpoint);

  TrainOptions over = options("run", {"train.updates=1", "train.speed=1"});
  over.old_run = OldRun::overwrite;
  EXPECT_THAT(message_of([&] { train(over); }), HasSubstr("train.speed"));
  EXPECT_EQ(read_file(folder_ / "run/checkpoint.ckpt"), checkpoint) << "what cannot begin removes nothing";
  over.overrides.pop_back();
  over.on_progress = [](const TrainProgress&) { throw Error("disk full"); };
  EXPECT_EQ(message_of([&] { train(over); }), "disk full");
  EXPECT_EQ(read_file(folder_ / "run/checkpoint.ckpt"), checkpoint) << "what ends before its first checkpoint neither";
  EXPECT_EQ(read_table(folder_ / "run/progress.csv").size(), 3u);
  over.on_progress = {};
  EXPECT_EQ(train(over).updates, 1);
  EXPECT_NE(read_file(folder_ / "run/checkpoint.ckpt"), checkpoint);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run/.pictura-new-run"));
  EXPECT_EQ(read_table(folder_ / "run/progress.csv").size(), 2u);
  EXPECT_EQ(count_events(), 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run/events.out.tfevents.17.5"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run/.pictura-0123456789abcdef.tmp"));
  EXPECT_EQ(read_file(folder_ / "run/notes.txt"), "mine");
  EXPECT_EQ(read_file(folder_ / "run/events.out.tfevents.17.host"), "another program's");
}

TEST_F(Training, TargetsOfLinksInItsFolderAreNotWritten) {
  for (const char* name : {"lock", "config.toml", "checkpoint.next.ckpt", "progress.csv", "learning_curve.png"}) {
    const std::string run = folder_ / (std::string("run_with_") + name);
    std::filesystem::create_directory(run);
    write_file(folder_ / "mine", "text");
    std::filesystem::create_symlink("../mine", run + "/" + name);
    TrainOptions linked = options(std::filesystem::path(run).filename().string(), {"train.updates=1"});
    linked.old_run = OldRun::overwrite;
    EXPECT_THAT(message_of([&] { train(linked); }), AllOf(HasSubstr(run + "/" + name), HasSubstr("got a link")));
    EXPECT_EQ(read_file(folder_ / "mine"), "text");
  }
}

TEST_F(Training, TheLastCheckpointsAreKept) {
  const auto update_of = [&](const std::string& name) -> int64_t {
    const std::string path = folder_ / ("run/" + name);
    return std::filesystem::exists(path) ? read_checkpoint(path).update : -1;
  };
  const auto updates = [&] {
    return std::vector<int64_t>{update_of("checkpoint.ckpt"), update_of("checkpoint.1.ckpt"),
                                update_of("checkpoint.2.ckpt"), update_of("checkpoint.3.ckpt")};
  };
  using Updates = std::vector<int64_t>;
  TrainOptions o = options("run", {"train.checkpoint_every=1", "train.updates=2", "train.keep_checkpoints=3"});
  train(o);
  EXPECT_EQ(updates(), (Updates{2, 1, -1, -1}));
  o.old_run = OldRun::resume;
  train(o);
  EXPECT_EQ(updates(), (Updates{2, 1, -1, -1})) << "nothing was done";
  o.overrides.push_back("train.updates=4");
  train(o);
  EXPECT_EQ(updates(), (Updates{4, 3, 2, -1}));
  // With a smaller number of kept checkpoints, surplus checkpoints are removed.
  const std::string newest = read_file(folder_ / "run/checkpoint.ckpt");
  constexpr auto kPrivate = std::filesystem::perms::owner_read | std::filesystem::perms::owner_write;
  std::filesystem::permissions(folder_ / "run/checkpoint.ckpt", kPrivate);
  save_checkpoint(folder_ / "run", 2, [&](const std::string& path) { write_file(path, "next"); });
  EXPECT_EQ(std::filesystem::status(folder_ / "run/checkpoint.ckpt").permissions(), kPrivate);
  EXPECT_EQ(read_file(folder_ / "run/checkpoint.ckpt"), "next");
  EXPECT_EQ(read_file(folder_ / "run/checkpoint.1.ckpt"), newest);
  EXPECT_EQ(update_of("checkpoint.2.ckpt"), -1);
  EXPECT_THROW(save_checkpoint(folder_ / "run", 2, [](const std::string&) { throw Error("disk full"); }), Error);
  EXPECT_EQ(read_file(folder_ / "run/checkpoint.ckpt"), "next");
  EXPECT_EQ(read_file(folder_ / "run/checkpoint.1.ckpt"), newest);
}

TEST(Milestones, AreNamedByTheLastMultipleWithinAnUpdate) {
  EXPECT_EQ(milestone_name(0, 249999999, 250000000), "");
  EXPECT_EQ(milestone_name(249999999, 250000000, 250000000), "milestone_250M.ckpt");
  EXPECT_EQ(milestone_name(250000000, 251000000, 250000000), "");
  EXPECT_EQ(milestone_name(251000000, 1300000000, 250000000), "milestone_1250M.ckpt");
  EXPECT_EQ(milestone_name(1400000, 1600000, 1500000), "milestone_1500k.ckpt");
  EXPECT_EQ(milestone_name(90, 110, 50), "milestone_100.ckpt");
  EXPECT_EQ(milestone_name(90, 110, 0), "");
}

TEST_F(Training, MilestonesAreKeptAndEqualAfterResuming) {
  const std::vector<std::string> settings{"train.milestone_agent_steps=50", "train.checkpoint_every=1"};
  const auto milestones = [&](const std::string& run) {
    std::vector<std::pair<std::string, int64_t>> all;
    for (const std::string& name : run_files(folder_ / run)) {
      if (!name.starts_with("milestone_")) continue;
      const Checkpoint saved = read_checkpoint(folder_ / (run + "/" + name));
      const int64_t steps = std::stoll(name.substr(std::strlen("milestone_")));
      EXPECT_GE(saved.agent_steps, steps);
      EXPECT_LT(saved.agent_steps, steps + 50) << "the last multiple";
      all.emplace_back(name, saved.agent_steps);
    }
    return all;
  };
  train(options("whole", settings));
  TrainOptions part = options("parts", settings);
  part.overrides.push_back("train.updates=2");
  train(part);
  EXPECT_LT(milestones("parts").size(), milestones("whole").size());
  part.overrides.back() = "train.updates=4";
  part.old_run = OldRun::resume;
  train(part);
  EXPECT_EQ(milestones("parts"), milestones("whole"));

  // A milestone that cannot be written is written when the run resumes: no later checkpoint exists.
  const std::string first = milestones("whole").front().first;
  const std::string obstacle = folder_ / ("blocked/" + first + "/x");
  std::filesystem::create_directories(obstacle);
  TrainOptions blocked = options("blocked", settings);
  EXPECT_THAT(message_of([&] { train(blocked); }), HasSubstr(first));
  std::filesystem::remove_all(folder_ / ("blocked/" + first));
  blocked.old_run = OldRun::resume;
  train(blocked);
  EXPECT_EQ(milestones("blocked"), milestones("whole"));
}

TEST_F(Training, ADivergingRunStopsAndKeepsTheMinibatch) {
  TrainOptions o = options("run", {"policy.modality=vector", "train.learning_rate=100"});
  EXPECT_THAT(message_of([&] { train(o); }), AllOf(HasSubstr("update 1, epoch "), HasSubstr("not finite"),
                                                   HasSubstr(folder_ / "run/failed_minibatch.safetensors")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run/checkpoint.ckpt")) << "the last good policy is the untrained one";
  EXPECT_EQ(read_checkpoint(folder_ / "run/untrained.ckpt").update, 0);
  const std::string kept = read_file(folder_ / "run/failed_minibatch.safetensors");
  EXPECT_THAT(kept, AllOf(HasSubstr(R"("rows":{"dtype":"I64")"), HasSubstr(R"("lanes":{"dtype":"F32")")));
}

TEST_F(Training, ASecondRunIntoAFolderInUseIsRefusedAndTheFirstContinues) {
  std::vector<std::string> refusals;
  TrainOptions first = options("run", {"train.updates=2"});
  first.on_progress = [&](const TrainProgress&) {
    TrainOptions second = options("run");
    refusals.push_back(message_of([&] { train(second); }));
    second.old_run = OldRun::resume;
    refusals.push_back(message_of([&] { train(second); }));
  };
  const TrainReport report = train(first);
  EXPECT_EQ(report.updates, 2);
  EXPECT_THAT(refusals, ::testing::ElementsAreArray(std::vector<std::string>(
                            4, fmt::format("{}: in use by process {}", folder_ / "run", getpid()))));
  EXPECT_EQ(train(options("alone", {"train.updates=2"})).policy_hash, report.policy_hash);
}

TEST_F(Training, ResumeErrorsNameConfigurationDifferences) {
  train(options("run", {"train.updates=1"}));
  TrainOptions changed = options("run", {"policy.backbone_width=64"});
  changed.old_run = OldRun::resume;
  try {
    train(changed);
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("checkpoint.ckpt"), HasSubstr("policy.backbone_width: 128 became 64")));
  }
  TrainOptions nothing = options("nowhere");
  nothing.old_run = OldRun::resume;
  EXPECT_THROW(train(nothing), Error);
}

TEST_F(Training, ResumesWithOtherNumbersOfAgentsAndMinibatches) {
  const TrainReport first = train(options("run", {"train.updates=1"}));
  TrainOptions rest = options("run", {"train.updates=2", "simulator.num_slots=48", "train.minibatch_size=96"});
  rest.old_run = OldRun::resume;
  std::vector<std::string> notices;
  rest.on_notice = [&notices](const std::string& notice) { notices.push_back(notice); };
  const TrainReport report = train(rest);
  EXPECT_EQ(report.updates, 2);
  EXPECT_GT(report.agent_steps, first.agent_steps);
  EXPECT_THAT(notices, Contains(HasSubstr("new episodes begin: simulator state: the saved state differs in: worlds")));
  EXPECT_THAT(notices, Contains(HasSubstr("simulator.num_slots: ")));
  EXPECT_THAT(notices, Contains(HasSubstr("train.minibatch_size: ")));
}

TEST_F(Training, StartsWithWeightsOfAnotherRunAtAnyImageSize) {
  const std::string first = train(options("first", {"train.updates=1"})).checkpoint;
  const std::vector<NamedTensor> other = read_checkpoint(first).parameters;
  for (const std::string file : {"checkpoint.ckpt", "policy.safetensors"}) {
    SCOPED_TRACE(file);
    TrainOptions o = options("second " + file, {"train.updates=1", "render.width_px=20", "run.seed=5"});
    o.init_from = folder_ / ("first/" + file);
    train(o);
    const Checkpoint begun = read_checkpoint(o.out_folder + "/untrained.ckpt");
    EXPECT_EQ(begun.agent_steps, 0);
    EXPECT_EQ(begun.update, 0);
    EXPECT_EQ(begun.adam_steps, 0);
    ASSERT_EQ(begun.parameters.size(), other.size());
    for (size_t i = 0; i < other.size(); ++i) {
      EXPECT_TRUE(begun.parameters[i].value.equal(other[i].value)) << other[i].name;
    }
  }
  TrainOptions wider = options("wider", {"policy.backbone_width=64"});
  wider.init_from = first;
  EXPECT_THAT(message_of([&] { train(wider); }), AllOf(HasSubstr(first), HasSubstr("a different architecture")));
  TrainOptions normalized = options("normalized", {"policy.layer_norm=true"});
  normalized.init_from = first;
  EXPECT_THAT(message_of([&] { train(normalized); }),
              AllOf(HasSubstr(first), HasSubstr("policy.layer_norm: expected true, got false")));
  TrainOptions reads_more = options("reads more", {"policy.modality=vector", "policy.segment_features=true"});
  reads_more.init_from = first;
  EXPECT_THAT(message_of([&] { train(reads_more); }),
              AllOf(HasSubstr(first), HasSubstr("policy.segment_features: expected true, got false")));
}

TEST_F(Training, StartsWithTheTrunkOfAnotherModality) {
  const auto is_of_trunk = [](const std::string& name) {
    return std::ranges::any_of(std::array{"ego.", "conditioning.", "backbone.", "actor.", "critic."},
                               [&](const char* begin) { return name.starts_with(begin); });
  };
  const auto untrained = [&](const TrainOptions& o) {
    train(o);
    return read_checkpoint(o.out_folder + "/untrained.ckpt").parameters;
  };
  for (const auto& [own, others] : {std::pair{"perspective", "vector"}, {"vector", "perspective"}}) {
    SCOPED_TRACE(own);
    const std::string other = train(options(others + std::string(" other"), {"train.updates=1", "run.seed=5",
                                                                             std::string("policy.modality=") + others}))
                                  .checkpoint;
    TrainOptions o = options(own + std::string(" plain"), {"train.updates=1", std::string("policy.modality=") + own});
    const std::vector<NamedTensor> plain = untrained(o), from = read_checkpoint(other).parameters;
    // The encoder has the weights of another run, whose seed differs.
    o.init_from = o.out_folder + "/untrained.ckpt";
    o.overrides.push_back("run.seed=7");
    o.out_folder = folder_ / (own + std::string(" begun"));
    o.init_trunk_from = other;
    size_t of_trunk = 0;
    const std::vector<NamedTensor> begun = untrained(o);
    for (size_t i = 0; i < begun.size(); ++i) {
      const auto& [name, value] = begun[i];
      if (!is_of_trunk(name)) {
        EXPECT_TRUE(value.equal(plain[i].value)) << name;
        continue;
      }
      ++of_trunk;
      at::Tensor expected = plain[i].value.clone();
      const auto its = std::ranges::find(from, name, &NamedTensor::name);
      ASSERT_NE(its, from.end()) << name;
      if (name == "ego.hidden.weight") {
        expected.narrow(1, 0, kEgoFeatures - 2).copy_(its->value.narrow(1, 0, kEgoFeatures - 2));
      } else {
        expected.copy_(its->value);
      }
      EXPECT_TRUE(value.equal(expected)) << name;
    }
    EXPECT_EQ(of_trunk, 4u + 4 + 2 * 2 + 4);
    EXPECT_LT(of_trunk, begun.size());
  }
}

TEST_F(Training, ErrorsNameTrunksThatDoNotFit) {
  const std::string vector = train(options("vector", {"train.updates=1", "policy.modality=vector"})).checkpoint;
  const auto message = [&](const std::vector<std::string>& settings, OldRun old_run = OldRun::refuse) {
    TrainOptions o = options("run", settings);
    o.init_trunk_from = vector;
    o.old_run = old_run;
    return message_of([&] { train(o); });
  };
  EXPECT_THAT(
      message({"policy.backbone_width=64"}),
      HasSubstr(vector + ": has a different architecture: parameter 'backbone.0.weight': expected [64, 384], got "
                         "[128, 384]"));
  EXPECT_THAT(message({"policy.embedding_width=32"}),
              AllOf(HasSubstr(vector), HasSubstr("parameter 'ego.hidden.weight'")));
  EXPECT_THAT(message({"policy.backbone_layers=3"}),
              AllOf(HasSubstr(vector), HasSubstr("no parameter 'backbone.2.weight'")));
  EXPECT_THAT(message({"policy.residual=true"}),
              AllOf(HasSubstr(vector), HasSubstr("policy.residual: expected true, got false")));
  EXPECT_THAT(message({}, OldRun::resume), AllOf(HasSubstr("init_trunk_from"), HasSubstr("a new run, got resume")));
}

TEST_F(Training, StopsOnNonFiniteLogits) {
  // Logits exceed all floats after an update.
  const TrainOptions o = options("run", {"train.updates=4", "train.sharpen_agent_steps=1"});
  EXPECT_THAT(message_of([&] { train(o); }), HasSubstr("update 3: expected finite logits and values in the rollout"));
}

TEST_F(Training, RefusesToDriveWithNonFiniteLogits) {
  SavedPolicy policy = read_policy(train(options("run", {"train.updates=1", "policy.modality=vector"})).checkpoint);
  for (NamedTensor& parameter : policy.parameters) {
    if (parameter.name == "actor.weight") parameter.value.fill_(3e38);  // finite, but its sums are not
  }
  const std::string path = folder_ / "large.safetensors";
  write_policy(path, policy, WeightType::f32, "");
  EXPECT_THAT(message_of([&] { evaluate(test::one_scenario(path, 10)); }),
              HasSubstr("expected finite logits and values"));
}

TEST_F(Training, RefusesInvalidMinutes) {
  for (const double minutes :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TrainOptions o = options("run", {});
    o.minutes = minutes;
    EXPECT_THAT(message_of([&] { train(o); }), HasSubstr("minutes: expected 0 (no limit) or more"));
    EXPECT_FALSE(std::filesystem::exists(o.out_folder));
  }
}

TEST_F(Training, ANormalizedPolicyWithAQuantileFilterResumesExactly) {
  const auto [whole, again, resumed] = test::policies_of_equal_runs(
      folder_ / "runs", "cpu",
      {"policy.modality=vector", "policy.layer_norm=true", "policy.residual=true", "train.adv_filter=quantile"});
  EXPECT_EQ(whole, again);
  EXPECT_EQ(whole, resumed);
}

TEST_F(Training, ASegmentPolicyResumesExactlyAndIsEvaluatedAsSaved) {
  const auto [whole, again, resumed] =
      test::policies_of_equal_runs(folder_ / "runs", "cpu", {"policy.modality=vector", "policy.segment_features=true"});
  EXPECT_EQ(whole, again);
  EXPECT_EQ(whole, resumed);
  const SavedPolicy saved = read_policy(folder_ / "runs/whole/policy.safetensors");
  EXPECT_TRUE(saved.config.policy.segment_features);
  EXPECT_GT(evaluate(test::one_scenario(folder_ / "runs/whole/policy.safetensors", 10)).agent_steps, 0);
}

TEST_F(Training, VectorPolicyTrainsAndIsEvaluated) {
  const TrainReport report = train(options("run", {"train.updates=1", "policy.modality=vector"}));
  EvaluateOptions o;
  o.device = "cpu";
  o.checkpoint = report.checkpoint;
  o.maps = {"procedural"};
  o.agents_per_world = 6;
  o.scenarios = 3;
  o.steps = 25;
  o.num_threads = 1;
  o.renderer = "cpu";
  double done = 0;
  o.on_progress = [&](double fraction, double) { done = fraction; };
  const EvaluateReport evaluated = evaluate(o);
  EXPECT_FALSE(evaluated.interrupted);
  const std::vector<EvaluateRow>& rows = evaluated.rows;
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].scenarios, 3);
  EXPECT_LE(rows[0].vehicle_episodes, 18);
  EXPECT_GT(rows[0].vehicle_episodes, 0);
  EXPECT_EQ(done, 1);
  EXPECT_GT(evaluated.seconds, 0);
  EXPECT_GT(evaluated.agent_steps, 0);
  EXPECT_LE(evaluated.agent_steps, 3 * 6 * 25);
  for (const double rate :
       {rows[0].at_fault_collision_rate.value, rows[0].off_road_rate.value, rows[0].red_light_rate.value}) {
    EXPECT_GE(rate, 0);
    EXPECT_LE(rate, 1);
  }
  // The repetition is equal, and drawn actions give something else.
  const std::vector<EvaluateRow> again = evaluate(o).rows;
  EXPECT_EQ(again[0].km_driven, rows[0].km_driven);
  // Evaluates in parts, also with a session that is kept.
  o.scenarios = 2;
  const EvaluationResults first = evaluate(o).results;
  o.first_scenario = 2;
  o.scenarios = 1;
  SessionOptions session_options;
  session_options.device = "cpu";
  session_options.num_threads = 1;
  PolicySession session(report.checkpoint, session_options);
  const EvaluationResults second = evaluate(&session, o).results;
  write_results(folder_ / "merged.json", merge({second, first}, {"second", "first"}));
  write_results(folder_ / "whole.json", evaluated.results);
  EXPECT_EQ(read_file(folder_ / "merged.json"), read_file(folder_ / "whole.json"));
  o.first_scenario = 0;
  o.scenarios = 3;
  o.argmax = false;
  EXPECT_NE(evaluate(o).rows[0].km_driven, rows[0].km_driven);
  o.scenarios = 0;
  EXPECT_THROW(evaluate(o), UsageError);
}

TEST_F(Training, InterruptedEvaluationKeepsFinishedScenarios) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EvaluateOptions o;
  o.device = "cpu";
  o.checkpoint = train(options("run", {"train.updates=1", "policy.modality=vector"})).checkpoint;
  o.maps = {"procedural"};
  o.scenarios = 1;
  o.steps = 5;
  o.num_threads = 1;
  o.renderer = "cpu";
  // The first 60 of 60, 120 and 150 agents are done at 18 %.
  o.on_progress = [](double fraction, double) {
    if (fraction > 0.2) std::raise(SIGINT);
  };
  EXPECT_EXIT(
      {
        catch_interrupts();
        const EvaluateReport report = evaluate(o);
        std::exit(report.interrupted && report.seconds > 0 && report.rows.size() == 1 &&
                          report.rows[0].density == "light" && report.rows[0].km_driven > 0
                      ? 0
                      : 1);
      },
      ::testing::ExitedWithCode(0), "");
}

TEST_F(Training, EvaluationAndTrainingWorldsDiffer) {
  static_assert(kFirstEvaluationWorld >= uint32_t{kMaxSlots}, "training has at most one world per agent");
  EvaluateOptions o;
  o.device = "cpu";
  o.checkpoint = train(options("run", {"train.updates=1", "policy.modality=vector"})).checkpoint;
  o.maps = {"procedural"};
  o.agents_per_world = 6;
  o.scenarios = 1;
  o.steps = 10;
  o.num_threads = 1;
  o.renderer = "cpu";
  // Repeats the drive by hand, in the world of that number.
  auto return_per_vehicle = [&](uint32_t global_world) {
    SimulatorConfig config = evaluation_simulator_config(load_config(folder_ / "run/config.toml"), o.steps);
    config.seed = o.seed;
    const std::unique_ptr<Simulator> simulator =
        make_simulator("cpu", config, {load_map("procedural")}, {WorldSpec{0, 6, global_world}});
    PolicySession session(o.checkpoint, {.num_threads = 1});
    const std::unique_ptr<Controller> controller = session.make_controller(nullptr, /*argmax=*/true, o.seed);
    simulator->reset();
    std::vector<Command> commands(6);
    for (int step = 0; step < o.steps; ++step) {
      controller->act(simulator->arrays(), {}, commands);
      simulator->step(commands);
    }
    double sum = 0;
    for (int slot = 0; slot < 6; ++slot) sum += static_cast<double>(simulator->state().episode_return[slot]);
    return sum / 6;
  };
  const double evaluated = evaluate(o).rows.at(0).return_per_vehicle.value;
  EXPECT_EQ(evaluated, return_per_vehicle(kFirstEvaluationWorld));
  EXPECT_NE(evaluated, return_per_vehicle(0));
}

// Writes a rig of one camera, unlike the paper's.
std::string one_camera(const std::string& path) {
  write_file(path, "[[camera]]\nname = \"ahead\"\nwidth_px = 20\nheight_px = 12\nfocal_px = 11\nx_m = 1\nz_m = 1.5\n");
  return path;
}

TEST_F(Training, EvaluationUsesWorldAndImageSettingsOfTraining) {
  const std::string rig = one_camera(folder_ / "rig.toml");
  write_file(
      folder_ / "config.toml",
      fmt::format("[simulator]\nmaps = [\"procedural\"]\nmax_agents = 8\nwalls = true\nwall_seed = 77\nparked_cars "
                  "= 3\nlight_cycles = \"independent\"\npedestrian_fraction = 0.25\n[render]\nrig = "
                  "\"{}\"\nline_floor_px = 1.5\n"
                  "[policy]\nbackbone_width = 32\n[train]\nminibatch_size = 64\nforward_chunk = 64\n",
                  rig));
  TrainOptions o = options("run", {"train.updates=1"});
  o.config_path = folder_ / "config.toml";
  std::erase_if(o.overrides, [](const std::string& text) { return text.starts_with("render."); });
  const std::string checkpoint = train(o).checkpoint;

  const PolicySession session(checkpoint, {.num_threads = 1});
  EXPECT_TRUE(session.reads_images());
  EXPECT_EQ(session.renderer_config().line_floor_px, 1.5f);
  EXPECT_EQ(session.renderer_config().rig.cameras.at(0).name, "ahead");
  EXPECT_EQ(session.evaluation_world(9).wall_seed, 77u);
  EXPECT_EQ(session.evaluation_world(9).episode_steps, 9);
  EXPECT_EQ(session.evaluation_world(9).light_cycles, LightCycles::independent);
  EXPECT_EQ(session.config().simulator.light_cycles, LightCycles::independent);
  const PolicySession in_turns(checkpoint, {.num_threads = 1, .light_cycles = LightCycles::phases});
  EXPECT_EQ(in_turns.evaluation_world(9).light_cycles, LightCycles::phases);
  EXPECT_EQ(in_turns.config().simulator.light_cycles, LightCycles::phases);
  EXPECT_EQ(session.training_world().conditioning[0].high,
            simulator_config(load_config(o.config_path)).conditioning[0].high);
  EXPECT_EQ(session.make_renderer()->config().rig.cameras.size(), 1u);

  // World in which `pictura simulate` drives, and which it films.
  WorldOptions world_options;
  world_options.map = "procedural";
  world_options.agents = 4;
  DrivenWorld world = make_world(world_options, checkpoint);
  EXPECT_EQ(world.simulator->config().wall_seed, 77u);
  EXPECT_EQ(world.simulator->config().parked_cars, 3);
  EXPECT_EQ(world.simulator->config().light_cycles, LightCycles::independent);
  EXPECT_EQ(world.simulator->config().pedestrian_fraction, 0.25f);
  EXPECT_FALSE(world.simulator->config().vector_observations);
  ASSERT_TRUE(world.renderer && world.trained_view);
  EXPECT_EQ(world.renderer->config().line_floor_px, 1.5f);
  EXPECT_EQ(world.renderer->config().rig.cameras.size(), 1u);
  EXPECT_EQ(world.trained_view->line_floor_px, 1.5f);
  EXPECT_EQ(world.trained_view->rig.cameras.at(0).name, "ahead");
  world.act();
  world.step();
  // Command-line options take precedence.
  world_options.walls = false;
  world_options.parked_cars = 1;
  world_options.light_cycles = LightCycles::phases;
  world_options.renderer = "null";
  world = make_world(world_options, checkpoint);
  EXPECT_FALSE(world.simulator->config().walls);
  EXPECT_EQ(world.simulator->config().parked_cars, 1);
  EXPECT_EQ(world.simulator->config().light_cycles, LightCycles::phases);
  EXPECT_EQ(world.renderer->name(), "null");
  WorldOptions on_device = world_options;
  on_device.device = "cuda";
  EXPECT_THAT(message_of([&] { make_world(on_device, checkpoint); }), HasSubstr("run.device"));
  on_device.simulator = "cuda";
  EXPECT_THROW(make_world(on_device, checkpoint), UsageError);
}

TEST_F(Training, ASessionGivesLogitsAndValuesOfAnyScene) {
  const std::string checkpoint = train(options("run", {"train.updates=1"})).checkpoint;
  PolicySession session(checkpoint, {.num_threads = 1});
  const std::unique_ptr<Renderer> renderer = session.make_renderer();
  const std::unique_ptr<Simulator> simulator =
      make_simulator("cpu", session.training_world(), {load_map("procedural")}, {WorldSpec{0, 6, 5}});
  upload_maps(*simulator, renderer.get());
  simulator->reset();
  const SimulatorArrays input = simulator->arrays();
  std::vector<float> logits(6 * kNumActions), values(6);
  session.evaluate({input.observations, &input.scene, input.views, {}}, renderer.get(), logits, values);
  EXPECT_NE(values[0], values[1]);

  // The controller takes the most likely action.
  std::vector<Command> commands(6);
  const std::unique_ptr<PolicyController> controller = session.make_controller(renderer.get(), /*argmax=*/true, 1);
  controller->act(input, {}, commands);
  EXPECT_EQ(controller->num_driven(), 6);
  for (size_t agent = 0; agent < 6; ++agent) {
    const auto first = logits.begin() + static_cast<std::ptrdiff_t>(agent * kNumActions);
    EXPECT_EQ(commands[agent].action, std::max_element(first, first + kNumActions) - first) << agent;
  }
  // A mask leaves the commands of other agents unchanged.
  std::vector<Command> some(6, Command{.kind = CommandKind::absent});
  const std::vector<uint8_t> mask{0, 1, 0, 0, 1, 0};
  controller->act(input, mask, some);
  EXPECT_EQ(controller->num_driven(), 2);
  for (size_t agent = 0; agent < 6; ++agent) {
    EXPECT_EQ(some[agent].kind, mask[agent] ? CommandKind::action : CommandKind::absent) << agent;
  }

  // A batch need not be a simulator's slots: agents 4 and 1 alone give the same numbers.
  std::vector<float> two_logits(2 * kNumActions), two_values(2);
  const std::vector<View> views{input.views[4], input.views[1]};
  std::vector<float> ego, conditioning, waypoints;
  for (const size_t agent : {size_t{4}, size_t{1}}) {
    const auto append = [agent](Span<float> all, size_t per_slot, std::vector<float>* out) {
      out->insert(out->end(), all.begin() + agent * per_slot, all.begin() + (agent + 1) * per_slot);
    };
    append(input.observations.ego, kEgoFeatures, &ego);
    append(input.observations.conditioning, kNumConditioning, &conditioning);
    append(input.observations.waypoints, kNumWaypoints * kWaypointFeatures, &waypoints);
  }
  ObservationView two;
  two.ego = ego;
  two.conditioning = conditioning;
  two.waypoints = waypoints;
  session.evaluate({two, &input.scene, views, {}}, renderer.get(), two_logits, two_values);
  EXPECT_NEAR(two_values[0], values[4], 1e-5);
  EXPECT_NEAR(two_values[1], values[1], 1e-5);
  EXPECT_NEAR(two_logits[3], logits[4 * kNumActions + 3], 1e-5);

  EXPECT_THAT(message_of([&] {
                session.evaluate({input.observations, &input.scene, views, {}}, renderer.get(), two_logits, two_values);
              }),
              AllOf(HasSubstr("ego"), HasSubstr("18"), HasSubstr("54")));
  EXPECT_THAT(
      message_of([&] { session.evaluate({two, &input.scene, {}, {}}, renderer.get(), two_logits, two_values); }),
      HasSubstr("expected 2 views, got 0"));
  EXPECT_THAT(message_of([&] { session.evaluate({two, nullptr, {}, {}}, nullptr, two_logits, two_values); }),
              HasSubstr("renderer"));
}

TEST_F(Training, TheVectorPolicyLearnsFromObservedWalls) {
  const std::vector<std::string> walls{"train.updates=1", "policy.modality=vector", "simulator.walls=true",
                                       "simulator.wall_observations=true"};
  const TrainReport report = train(options("run", walls));
  EXPECT_EQ(report.renderer, "");
  EvaluateOptions o = one_scenario(report.checkpoint, 5);
  o.agents_per_world = 6;
  EXPECT_GT(evaluate(o).rows.at(0).km_driven, 0);
  EXPECT_TRUE(PolicySession(report.checkpoint).evaluation_world(5).wall_observations);
  TrainOptions without = options("run", {"train.updates=2", "policy.modality=vector", "simulator.walls=true"});
  without.old_run = OldRun::resume;
  EXPECT_THAT(message_of([&] { train(without); }), HasSubstr("simulator.wall_observations: true became false"));
}

TEST_F(Training, PerspectivePolicyIsEvaluatedFromItsImages) {
  const TrainReport report = train(options("run", {"train.updates=1"}));
  EvaluateOptions o = one_scenario(report.checkpoint, 3);
  o.densities = {Density::light};
  o.renderer = "cpu";
  const std::vector<EvaluateRow> rows = evaluate(o).rows;
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].density, "light");
  EXPECT_GT(rows[0].vehicle_episodes, 0);
  EXPECT_LE(rows[0].vehicle_episodes, 60);
  EXPECT_GT(rows[0].km_driven, 0);
}

TEST_F(Training, APolicyIsEvaluatedThroughOtherCameras) {
  const TrainReport report = train(options("run", {"train.updates=1"}));
  const PolicySession larger(report.checkpoint, {.device = "cpu", .width_px = 40, .height_px = 20});
  EXPECT_EQ(first_difference(larger.rig(), paper_rig(40, 20)), "");
  EXPECT_NE(first_difference(PolicySession(report.checkpoint, {.device = "cpu"}).rig(), paper_rig(40, 20)), "");
  EvaluateOptions o = one_scenario(report.checkpoint, 3);
  o.agents_per_world = 4;
  o.width_px = 40;
  o.height_px = 20;
  EXPECT_GT(evaluate(o).rows.at(0).vehicle_episodes, 0);
  // Rigs need as many cameras as in training, of any kind.
  const auto write_rig = [&](int cameras) {
    std::string text;
    for (int i = 0; i < cameras; ++i) {
      text +=
          fmt::format("[[camera]]\nname = \"c{}\"\nwidth_px = {}\nheight_px = 9\nfocal_px = 8\nx_m = 1\n", i, 16 + i);
    }
    write_file(folder_ / "rig.toml", text);
  };
  o.rig = folder_ / "rig.toml";
  write_rig(4);
  EXPECT_THAT(message_of([&] { evaluate(o); }), HasSubstr("a rig or a size, got both"));
  o.width_px = o.height_px = 0;
  EXPECT_GT(evaluate(o).rows.at(0).vehicle_episodes, 0);
  write_rig(3);
  EXPECT_THAT(message_of([&] { evaluate(o); }),
              AllOf(HasSubstr("rig.toml"), HasSubstr("expected 4 cameras"), HasSubstr("got 3")));
  const TrainReport vector = train(options("vector", {"train.updates=1", "policy.modality=vector"}));
  o.checkpoint = vector.checkpoint;
  EXPECT_THAT(message_of([&] { evaluate(o); }), HasSubstr("reads no images"));
}

}  // namespace
}  // namespace pictura
