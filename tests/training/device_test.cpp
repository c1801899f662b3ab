// Training on a CUDA device: policies learn in every precision, and results that must equal those of the host do.
// Without a device, the tests are skipped; if PICTURA_REQUIRE_GPU is 1, they fail instead.
#include "pictura/tests/backend_cuda/device_test.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>

#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/evaluation/probes/corner.h"
#include "pictura/evaluation/probes/removal.h"
#include "pictura/map/load_map.h"
#include "pictura/policy/torch_device.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/averaged_runs.h"
#include "pictura/training/ranks/ranks.h"
#include "pictura/training/run.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

class DeviceTraining : public test::DeviceTest {
 protected:
  TrainOptions options(const std::string& run, const std::string& device, std::vector<std::string> more) const {
    return test::small_run(folder_ / run, device, std::move(more));
  }
  /// Checks that a device's first update equals the host's, and that its reproducible runs in bf16 are equal.
  void expect_learns_as_on_the_host(std::vector<std::string> more) const;

  test::ScratchFolder folder_;
};

/// Rows of a progress.csv, by the names of their columns.
class Progress {
 public:
  explicit Progress(const std::string& path) : table_(test::read_table(path)) {}

  const std::vector<std::string>& names() const { return table_.at(0); }
  size_t num_updates() const { return table_.size() - 1; }
  /// Value of an update, counted from 1.
  double at(size_t update, const std::string& name) const {
    const auto column = std::find(names().begin(), names().end(), name) - names().begin();
    return std::stod(table_.at(update).at(static_cast<size_t>(column)));
  }

 private:
  std::vector<std::vector<std::string>> table_;
};

/// Checks that the first updates of two runs agree: in simulation to `tolerance`, in learning to `loss_tolerance`, both
/// of 1 + |value|. Clocks are excluded.
void expect_same_first_update(const std::string& run, const std::string& other, double tolerance,
                              double loss_tolerance) {
  const Progress a(run + "/progress.csv"), b(other + "/progress.csv");
  ASSERT_EQ(a.names(), b.names());
  for (const std::string& name : a.names()) {
    if (name.starts_with("time/") || name == "charts/agent_steps_per_s") continue;
    const double x = a.at(1, name), y = b.at(1, name);
    if (!std::isfinite(x)) {
      EXPECT_FALSE(std::isfinite(y)) << name;  // per km, if no agent moved; of episodes, if none has ended
      continue;
    }
    const bool is_of_learning = name.starts_with("losses/") || name.starts_with("charts/weight_rms");
    EXPECT_NEAR(x, y, (is_of_learning ? loss_tolerance : tolerance) * (1 + std::abs(x))) << name;
  }
  EXPECT_GT(a.at(1, "charts/agent_steps"), 0);
}

void DeviceTraining::expect_learns_as_on_the_host(std::vector<std::string> more) const {
  train(options("host", "cpu", more));
  train(options("device", "cuda", more));
  expect_same_first_update(folder_ / "host", folder_ / "device", 1e-6, 2e-2);
  more.insert(more.end(), {"train.reproducible=true", "train.precision=bf16"});
  const auto [whole, again, resumed] = test::policies_of_equal_runs(folder_ / "bf16", "cuda", more);
  EXPECT_EQ(again, whole);
  EXPECT_EQ(resumed, whole);
}

class EachModality : public DeviceTraining, public testing::WithParamInterface<const char*> {
 protected:
  static std::string modality() { return std::string("policy.modality=") + GetParam(); }
  // Settings of an update in fp32.
  static std::vector<std::string> one_update() {
    return {modality(), "train.precision=fp32", "train.updates=1", "train.num_steps=30", "train.forward_chunk=3"};
  }
};
INSTANTIATE_TEST_SUITE_P(All, EachModality, ::testing::Values("vector", "perspective"),
                         [](const auto& modality) { return std::string(modality.param); });

TEST_P(EachModality, LearnsInEachPrecision) {
  for (const char* precision : {"fp32", "tf32", "bf16"}) {
    SCOPED_TRACE(precision);
    const TrainReport report =
        train(options(precision, "cuda", {modality(), std::string("train.precision=") + precision, "train.updates=2"}));
    EXPECT_EQ(report.updates, 2);
    EXPECT_EQ(report.device, "cuda:0");
    EXPECT_EQ(report.simulator, "cuda");
    EXPECT_EQ(report.renderer, std::string(GetParam()) == "perspective" ? "cuda" : "");
    const Progress progress(folder_ / (std::string(precision) + "/progress.csv"));
    ASSERT_EQ(progress.num_updates(), 2u);
    for (const size_t update : {1, 2}) {
      double phases_s = 0;
      for (const std::string& name : progress.names()) {
        const double value = progress.at(update, name);
        EXPECT_TRUE(std::isfinite(value) || !name.starts_with("losses/")) << name << ": " << value;
        if (!name.starts_with("time/") || name == "time/rollout_s" || name == "time/update_s") continue;
        phases_s += value;
        // Only the perspective policy draws images.
        EXPECT_EQ(value > 0, name != "time/render_s" || !report.renderer.empty()) << name << ": " << value;
      }
      EXPECT_LT(phases_s, 1.01 * (progress.at(update, "time/rollout_s") + progress.at(update, "time/update_s")));
      EXPECT_GT(progress.at(update, "losses/grad_norm"), 0);
      EXPECT_GT(progress.at(update, "losses/kept_fraction"), 0);
    }
  }
}

TEST_P(EachModality, ReproducibleRunsGiveEqualPoliciesInEachPrecision) {
  for (const char* precision : {"fp32", "tf32", "bf16"}) {
    SCOPED_TRACE(precision);
    const auto [whole, again, resumed] = test::policies_of_equal_runs(
        folder_ / precision, "cuda",
        {modality(), std::string("train.precision=") + precision, "train.reproducible=true"});
    EXPECT_EQ(again, whole);
    EXPECT_EQ(resumed, whole);
  }
}

// The same actions are drawn in the same worlds, unless a rounding error decides: one draw in a million or so. So the
// simulators' counts are equal. Losses are means over minibatches between which roundings accumulate.
TEST_P(EachModality, TheFirstUpdateMatchesTheHosts) {
  train(options("host", "cpu", one_update()));
  train(options("device", "cuda", one_update()));
  expect_same_first_update(folder_ / "host", folder_ / "device", 1e-6, 2e-2);
}

TEST_P(EachModality, AQuantileFilterLearnsAsOnTheHost) {
  std::vector<std::string> more = one_update();
  more.push_back("train.adv_filter=quantile");
  expect_learns_as_on_the_host(more);
}

TEST_F(DeviceTraining, SegmentsAreReadAsOnTheHost) {
  expect_learns_as_on_the_host({"policy.modality=vector", "policy.segment_features=true", "train.precision=fp32",
                                "train.updates=1", "train.num_steps=30", "train.forward_chunk=3"});
}

TEST_P(EachModality, TrainingWithATeacherMatchesTheHost) {
  for (const std::string reads : {"vector", "perspective"}) {
    train(options(reads, "cpu", {"policy.modality=" + reads, "run.seed=5", "train.updates=1"}));
    std::vector<std::string> more = one_update();
    more.push_back("train.teacher=" + (folder_ / (reads + "/policy.safetensors")));
    train(options(reads + "_host", "cpu", more));
    train(options(reads + "_device", "cuda", more));
    expect_same_first_update(folder_ / (reads + "_host"), folder_ / (reads + "_device"), 1e-6, 2e-2);
  }
}

TEST_P(EachModality, EvaluationMatchesTheHosts) {
  EvaluateOptions o = test::one_scenario(
      train(options("run", "cpu", {modality(), "train.precision=fp32", "train.updates=1"})).checkpoint, 20);
  o.densities = {Density::light, Density::medium};
  o.scenarios = 2;
  o.num_threads = 0;
  const std::vector<EvaluateRow> on_host = evaluate(o).rows;
  o.device = "cuda";
  const std::vector<EvaluateRow> on_device = evaluate(o).rows;
  ASSERT_EQ(on_host.size(), 2u);
  ASSERT_EQ(on_device.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    const EvaluateRow &a = on_host[i], &b = on_device[i];
    SCOPED_TRACE(a.density);
    EXPECT_EQ(b.density, a.density);
    EXPECT_EQ(b.vehicle_episodes, a.vehicle_episodes);
    EXPECT_GT(b.vehicle_episodes, 60);
    // An action decided by a rounding error may change the result of a few vehicles.
    EXPECT_NEAR(b.at_fault_collision_rate.value, a.at_fault_collision_rate.value, 0.05);
    EXPECT_NEAR(b.off_road_rate.value, a.off_road_rate.value, 0.05);
    EXPECT_NEAR(b.red_light_rate.value, a.red_light_rate.value, 0.05);
    EXPECT_NEAR(b.goals_per_vehicle.value, a.goals_per_vehicle.value, 0.05);
    EXPECT_NEAR(b.waypoints_per_vehicle.value, a.waypoints_per_vehicle.value,
                0.05 * (1 + a.waypoints_per_vehicle.value));
    EXPECT_NEAR(b.km_driven, a.km_driven, 0.05 * a.km_driven);
    EXPECT_NEAR(b.return_per_vehicle.value, a.return_per_vehicle.value,
                0.05 * (1 + std::abs(a.return_per_vehicle.value)));
  }
}

// If a rounding error decides an action, states differ from then on: few cases may differ from the host's.
TEST_F(DeviceTraining, RemovalMatchesTheHosts) {
  RemovalOptions o;
  for (const char* modality : {"perspective", "vector"}) {
    const std::vector<std::string> more{fmt::format("policy.modality={}", modality), "train.precision=fp32",
                                        "train.updates=1", "simulator.walls=true"};
    o.policies.push_back(train(options(modality, "cpu", more)).checkpoint);
  }
  o.worlds.maps = {"procedural:1"};
  o.worlds.agents_per_world = 40;
  o.worlds.scenarios = 2;
  o.worlds.steps = 9;
  o.sample_steps = 4;
  o.removals = 300;
  o.worlds.device = "cpu";
  const RemovalResults on_host = probe_removal(o);
  o.worlds.device = "cuda";
  const RemovalResults on_device = probe_removal(o);
  ASSERT_EQ(on_device.cases.size(), on_host.cases.size());
  int same = 0, hidden = 0;
  for (size_t i = 0; i < on_host.cases.size(); ++i) {
    const RemovalCase &a = on_host.cases[i], &b = on_device.cases[i];
    const bool is_unseen = !b.is_in_frame() || b.visible_share == 0;
    hidden += is_unseen;
    EXPECT_TRUE(!is_unseen || on_device.response(i, 0).is_unchanged()) << i;
    if (std::tie(a.scene, a.step, a.ego, a.user, a.distance_m) !=
        std::tie(b.scene, b.step, b.ego, b.user, b.distance_m))
      continue;
    ++same;
    EXPECT_EQ(a.is_in_frame(), b.is_in_frame()) << i;
    EXPECT_TRUE(!a.is_in_frame() || std::abs(a.visible_share - b.visible_share) < 1e-3f) << i;
    for (size_t policy = 0; policy < 2; ++policy) {
      const PairedResponse &x = on_host.response(i, policy), &y = on_device.response(i, policy);
      EXPECT_NEAR(x.value, y.value, 1e-3) << i;
      EXPECT_NEAR(x.value_without, y.value_without, 1e-3) << i;
      EXPECT_NEAR(x.brake, y.brake, 1e-3) << i;
      EXPECT_NEAR(x.brake_without, y.brake_without, 1e-3) << i;
    }
  }
  EXPECT_GT(same, 270);
  EXPECT_GT(hidden, 20);
}

// The lane keeper drives identically on both, so that policies take over in the same states, bit for bit. From there a
// rounding error may decide an action.
TEST_F(DeviceTraining, TakeoversAtCornersStartAsOnTheHost) {
  CornerOptions o;
  for (const char* modality : {"perspective", "vector"}) {
    const std::vector<std::string> more{fmt::format("policy.modality={}", modality), "train.precision=fp32",
                                        "train.updates=1", "simulator.walls=true"};
    o.policies.push_back(train(options(modality, "cpu", more)).checkpoint);
  }
  o.worlds.maps = {"procedural:1", "procedural:2"};
  o.worlds.agents_per_world = 90;
  o.worlds.scenarios = 4;
  o.worlds.steps = 300;
  o.worlds.controller = "lane";
  o.pairs = 8;
  o.worlds.device = o.worlds.simulator = "cpu";
  const CornerResults on_host = probe_corner(o);
  o.worlds.device = o.worlds.simulator = "cuda";
  const CornerResults on_device = probe_corner(o);
  ASSERT_GT(on_host.pairs.size(), 2u);
  ASSERT_EQ(on_device.pairs.size(), on_host.pairs.size());
  EXPECT_EQ(on_device.hidden_found, on_host.hidden_found);
  EXPECT_EQ(on_device.empty_found, on_host.empty_found);
  for (size_t pair = 0; pair < on_host.pairs.size(); ++pair) {
    const CornerState &a = on_host.pairs[pair].hidden, &b = on_device.pairs[pair].hidden;
    EXPECT_EQ(std::tie(a.scene, a.step, a.ego, a.user), std::tie(b.scene, b.step, b.ego, b.user)) << pair;
  }
  size_t alike = 0;
  for (size_t i = 0; i < on_host.takeovers.size(); ++i) {
    const Takeover &a = on_host.takeovers[i], &b = on_device.takeovers[i];
    EXPECT_EQ(std::tie(a.speed_mps[0], a.x_m[0], a.y_m[0]), std::tie(b.speed_mps[0], b.x_m[0], b.y_m[0])) << i;
    alike += a.x_m[5] == b.x_m[5];
  }
  EXPECT_GT(alike, on_host.takeovers.size() * 9 / 10) << "after half a second";
}

class MuonOnADevice : public test::DeviceTest {
 protected:
  void SetUp() override {
    DeviceTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    open_learning_device(
        load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", {"run.device=cuda", "render.backend=auto"}));
  }
};

// Three weights, from 0, after one step along gradients that are the same on every device.
std::vector<at::Tensor> after_step_of_muon(at::Device device, at::ScalarType type) {
  at::manual_seed(5);
  std::vector<at::Tensor> weights;
  for (const at::IntArrayRef shape : {at::IntArrayRef{512, 384}, {64, 20}, {128, 64}}) {
    const at::Tensor gradient = at::randn(shape);
    at::Tensor weight = at::zeros(shape, at::kFloat).to(device);
    weight.requires_grad_();
    weight.mutable_grad() = gradient.to(device);
    weights.push_back(weight);
  }
  Muon(weights, type, 0).step(1, at::zeros({}, at::kFloat).to(device));
  for (at::Tensor& weight : weights) weight = weight.detach().cpu();
  return weights;
}

TEST_F(MuonOnADevice, StepsAsOnTheHost) {
  const std::vector<at::Tensor> host = after_step_of_muon(at::kCPU, at::kFloat),
                                fp32 = after_step_of_muon(at::kCUDA, at::kFloat),
                                bf16 = after_step_of_muon(at::kCUDA, at::kBFloat16);
  for (size_t i = 0; i < host.size(); ++i) {
    EXPECT_LT((fp32[i] - host[i]).norm().item<double>() / host[i].norm().item<double>(), 2e-2) << i;
    EXPECT_LT((bf16[i] - host[i]).norm().item<double>() / host[i].norm().item<double>(), 2e-1) << i;
  }
}

// A weight after four steps from 0, the third of which fails.
at::Tensor after_steps_of_muon(bool uses_graphs) {
  at::manual_seed(5);
  const Device device{MemorySpace::cuda, 0};
  at::Tensor weight = at::zeros({64, 96}, at::TensorOptions(at::kFloat).device(at::kCUDA));
  weight.requires_grad_();
  weight.mutable_grad() = at::zeros_like(weight);
  OwnStream(device).run([&] {
    Muon muon({weight}, at::kBFloat16, 0.1, device, uses_graphs);
    for (int step = 0; step < 4; ++step) {
      weight.mutable_grad().copy_(step == 2 ? at::full({64, 96}, std::nan("")) : at::randn({64, 96}));
      muon.step(0.1 / (1 + step), at::full({}, step == 2 ? 1.0 : 0.0, at::TensorOptions(at::kFloat).device(at::kCUDA)));
    }
  });
  return weight.detach().cpu();
}

TEST_F(MuonOnADevice, GraphsGiveTheSameBits) {
  const at::Tensor calls = after_steps_of_muon(false), graphs = after_steps_of_muon(true);
  EXPECT_TRUE(calls.equal(graphs));
  EXPECT_GT(calls.abs().max().item<float>(), 0.01);
}

TEST_P(EachModality, ARunWithMuonResumesExactly) {
  const auto [whole, again, resumed] = test::policies_of_equal_runs(
      folder_ / "muon", "cuda", {modality(), "train.optimizer=muon", "train.reproducible=true"});
  EXPECT_EQ(again, whole);
  EXPECT_EQ(resumed, whole);
}

TEST_P(EachModality, HostAndDeviceResumeEachOthersRuns) {
  for (const auto& [first, second] : {std::pair{"cuda", "cpu"}, {"cpu", "cuda"}}) {
    const std::string run = std::string("from_") + first;
    SCOPED_TRACE(run);
    const auto resumed = [&](const char* updates) {
      TrainOptions o = options(run, second, {modality(), updates});
      o.old_run = OldRun::resume;
      o.on_notice = [](const std::string& notice) { ADD_FAILURE() << notice; };
      return train(o);
    };
    const TrainReport half = train(options(run, first, {modality(), "train.updates=2"}));
    const Checkpoint saved = read_checkpoint(half.checkpoint);
    // With no updates left it saves the checkpoint that it read.
    const TrainReport same = resumed("train.updates=2");
    EXPECT_EQ(same.updates, 2);
    EXPECT_EQ(same.policy_hash, half.policy_hash);
    EXPECT_EQ(same.agent_steps, half.agent_steps);
    EXPECT_EQ(same.km_driven, half.km_driven);
    const Checkpoint again = read_checkpoint(half.checkpoint);
    EXPECT_TRUE(test::are_equal(again.parameters, saved.parameters));
    EXPECT_TRUE(test::are_equal(again.first_moments, saved.first_moments));
    EXPECT_TRUE(test::are_equal(again.second_moments, saved.second_moments));
    EXPECT_EQ(again.simulator, saved.simulator);
    EXPECT_EQ(again.adam_steps, saved.adam_steps);
    EXPECT_EQ(again.filter_average, saved.filter_average);

    const TrainReport whole = resumed("train.updates=4");
    EXPECT_EQ(whole.updates, 4);
    EXPECT_NE(whole.policy_hash, half.policy_hash);
    EXPECT_GT(read_checkpoint(whole.checkpoint).adam_steps, saved.adam_steps);
    const Progress progress(folder_ / (run + "/progress.csv"));
    ASSERT_EQ(progress.num_updates(), 4u);
    for (size_t update = 1; update <= 4; ++update) {
      EXPECT_EQ(progress.at(update, "update"), static_cast<double>(update));
      if (update > 1) {
        EXPECT_GT(progress.at(update, "charts/agent_steps"), progress.at(update - 1, "charts/agent_steps"));
      }
    }
    EXPECT_EQ(progress.at(2, "charts/agent_steps"), static_cast<double>(half.agent_steps));
    EXPECT_EQ(progress.at(4, "charts/agent_steps"), static_cast<double>(whole.agent_steps));
  }
}

// Gradients are summed in an order that changes from run to run.
TEST_F(DeviceTraining, KeptAndRedrawnImagesTrainEqualPolicies) {
  const std::vector<std::string> more{"train.precision=fp32", "train.updates=1"};
  for (const char* images : {"kept", "redrawn"}) {
    TrainOptions o = options(images, "cuda", more);
    o.overrides.push_back(std::string("train.images=") + images);
    train(o);
  }
  expect_same_first_update(folder_ / "kept", folder_ / "redrawn", 1e-9, 1e-3);
}

TEST_F(DeviceTraining, ARolloutKeepsTheSameImagesAsOnTheHost) {
  constexpr int kSlots = 24;
  constexpr int64_t kSteps = 4;
  struct Kept {
    at::Tensor rows;
    std::vector<Observation> saw;  // kept, redrawn, and redrawn as patches of 4, 8, 12 and 16 px
  };
  const auto config_of = [](const std::string& device, const std::string& images) {
    return load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml",
                       {"run.device=" + device, "train.num_steps=3", "train.images=" + images});
  };
  const auto keep = [&](const std::string& name) {
    const Config kept = config_of(name, "kept"), redrawn = config_of(name, "redrawn");
    const Device device = open_learning_device(kept);
    EXPECT_EQ(device.is_host(), name == "cpu");
    const std::unique_ptr<Simulator> simulator =
        make_simulator(name, simulator_config(kept, device), {load_map("procedural")}, draw_worlds(1, kSlots, 8, 8, 1));
    const std::unique_ptr<Renderer> renderer = make_renderer(name, renderer_config(kept, rig_of(kept), device));
    upload_maps(*simulator, renderer.get());
    const std::unique_ptr<LearnerExecutor> executor = make_learner_executor(device);
    RolloutObservations all[] = {{kept, simulator.get(), renderer.get(), nullptr},
                                 {redrawn, simulator.get(), renderer.get(), nullptr}};
    simulator->reset();
    at::Tensor actions = at::arange(kSlots, at::kInt).remainder(kNumActions).to(torch_device(device));
    std::vector<at::Tensor> rows;
    for (int64_t step = 0; step < kSteps; ++step) {
      const at::Tensor slots = active_slots(simulator->arrays(), {}, false, executor.get());
      for (RolloutObservations& observations : all) observations.record(step, slots);
      rows.push_back(slots + step * kSlots);
      for (int i = 0; i < 20; ++i) simulator->step(Array(actions.data_ptr<int32_t>(), {kSlots}, device));
    }
    simulator->check();
    Kept result;
    result.rows = at::cat(rows).flip(0);
    for (const RolloutObservations& observations : all) {
      result.saw.push_back(observations.gather(result.rows).map([](const at::Tensor& t) { return t.cpu(); }));
    }
    for (const int patch_px : {4, 8, 12, 16}) {
      result.saw.push_back(all[1].gather(result.rows, patch_px).map([](const at::Tensor& t) { return t.cpu(); }));
    }
    renderer->check();
    result.rows = result.rows.cpu();
    return result;
  };
  const Kept host = keep("cpu"), device = keep("cuda");
  ASSERT_TRUE(device.rows.equal(host.rows));
  ASSERT_LT(host.rows.size(0), kSlots * kSteps) << "some have halted";
  ASSERT_GT(host.rows.size(0), 0);
  EXPECT_GT(host.saw[0].images.at(0).pixels.count_nonzero().item<int64_t>(), 1000);
  EXPECT_TRUE(host.saw[1].images.at(0).pixels.equal(host.saw[0].images[0].pixels));
  for (size_t i = 0; i < device.saw.size(); ++i) {
    const Observation& saw = device.saw[i];
    EXPECT_TRUE(saw.images.at(0).pixels.equal(host.saw[i].images.at(0).pixels)) << i;
    EXPECT_TRUE(saw.ego.equal(host.saw[0].ego));
    EXPECT_TRUE(saw.waypoints.equal(host.saw[0].waypoints));
  }
}

// The renderer writes the patches, graphs are captured again, and the learner's first probabilities are the rollout's.
TEST_F(DeviceTraining, ContinuesWithLargerPatches) {
  TrainOptions o =
      options("run", "cuda",
              {"policy.patch_px=4", "policy.conv_kernels=[1, 3]", "policy.conv_strides=[1, 1]", "train.precision=bf16",
               "train.images=redrawn", "train.updates=8", "render.schedule=[[250, 48, 27, 12, 1.05]]"});
  o.on_progress = [](const TrainProgress& progress) { EXPECT_LT(progress.cost.first_kl, 0.01) << progress.update; };
  std::vector<std::string> notices;
  o.on_notice = [&notices](const std::string& notice) { notices.push_back(notice); };
  const Checkpoint saved = read_checkpoint(train(o).checkpoint);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_THAT(notices[0], HasSubstr("images are 48x27 in patches of 12 px"));
  EXPECT_EQ(saved.config.policy.patch_px, 12);
  EXPECT_EQ(saved.rate_factors, (std::map<std::string, double>{{"conv.0.weight", 1.0 / 9}}));
  EXPECT_EQ(saved.update, 8);
}

TEST_F(DeviceTraining, StopsAtItsTimeLimitAndResumes) {
  TrainOptions o = options("run", "cuda", {"train.updates=2"});
  o.minutes = 1e-9;
  bool has_begun = false;
  o.on_progress = [&has_begun](const TrainProgress&) { has_begun = true; };
  const TrainReport stopped = train(o);
  EXPECT_TRUE(stopped.out_of_time);
  EXPECT_FALSE(has_begun);
  EXPECT_EQ(stopped.updates, 0);
  for (const char* name : {"config.toml", "untrained.ckpt", "checkpoint.ckpt", "policy.safetensors"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / (std::string("run/") + name))) << name;
  }
  o.old_run = OldRun::resume;
  o.minutes = 60;
  const TrainReport resumed = train(o);
  EXPECT_FALSE(resumed.out_of_time);
  EXPECT_EQ(resumed.updates, 2);
  EXPECT_GT(resumed.agent_steps, 0);
  EXPECT_EQ(Progress(folder_ / "run/progress.csv").num_updates(), 2u);
}

TEST_F(DeviceTraining, TheAverageOfWeightsMatchesTheDefinitionAndResumesExactly) {
  test::check_average_by_hand(folder_.path(), "cuda");
  test::check_average_resumes_exactly(folder_.path(), "cuda");
}

TEST_F(DeviceTraining, ADivergingRunStopsAndKeepsTheMinibatch) {
  const std::string run = folder_ / "run";
  EXPECT_THAT(
      message_of([&] { train(options("run", "cuda", {"policy.modality=vector", "train.learning_rate=100"})); }),
      AllOf(HasSubstr("update 1, epoch "), HasSubstr("not finite"), HasSubstr(run + "/failed_minibatch.safetensors")));
  EXPECT_TRUE(std::filesystem::exists(run + "/failed_minibatch.safetensors"));
}

TEST_F(DeviceTraining, AWorldOfOneRankComputesThroughNccl) {
  const Device device = open_learning_device(
      load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", {"run.device=cuda", "render.backend=auto"}));
  Ranks ranks{Launch{}};
  const std::unique_ptr<Communicator> communicator = make_nccl_communicator(&ranks, device);
  EXPECT_EQ(communicator->name(), "nccl");
  EXPECT_EQ(communicator->rank(), 0);
  EXPECT_EQ(communicator->size(), 1);
  for (const at::Device where : {torch_device(device), at::Device(at::kCPU)}) {
    for (const at::ScalarType type : {at::kByte, at::kInt, at::kLong, at::kFloat, at::kDouble}) {
      const at::Tensor numbers = at::arange(1, 1002, at::TensorOptions(type).device(where)), before = numbers.clone();
      communicator->sum(numbers);
      communicator->max(numbers);
      communicator->broadcast(numbers, 0);
      EXPECT_TRUE(numbers.equal(before)) << type << " on " << where;
    }
  }
  EXPECT_EQ(communicator->max_of(-2.5), -2.5);
  EXPECT_EQ(communicator->gather({1, 2, 3}), (std::vector<std::vector<uint8_t>>{{1, 2, 3}}));
  EXPECT_EQ(communicator->from_first("said"), "said");
  EXPECT_THAT(message_of([&] { communicator->sum(at::zeros({2}, at::kHalf)); }), HasSubstr("f64"));
}

TEST_F(DeviceTraining, AutoSelectsTheDeviceAndErrorsNameAbsentDevices) {
  const TrainReport report = train(options("auto", "auto", {"train.updates=1"}));
  EXPECT_EQ(report.device, "cuda:0");
  EXPECT_EQ(report.simulator, "cuda");
  EXPECT_EQ(report.renderer, "cuda");
  EXPECT_THAT(message_of([&] { train(options("beyond", "cuda:99", {})); }),
              AllOf(HasSubstr("run.device: expected cuda:0 to cuda:"), HasSubstr("got \"cuda:99\"")));
}

}  // namespace
}  // namespace pictura
