// On a CUDA device, all of training except the network's arithmetic gives the bits of the host. With CUDA graphs,
// training, including the network, gives the bits of training without graphs. Without a device, the tests are skipped;
// if PICTURA_REQUIRE_GPU is 1, they fail instead.
#include <c10/core/CachingDeviceAllocator.h>

#include "pictura/common/cuda/device_buffer.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/exact_policy.h"

namespace pictura {
namespace {

using test::exact_config;
using test::ExactRun;
using test::run_exactly;

class DeviceExact : public test::DeviceTest {
 protected:
  ~DeviceExact() override { set_reproducible(false); }
};

TEST_F(DeviceExact, ThreeUpdatesMatchTheHosts) {
  const ExactRun host = run_exactly(exact_config("cpu", {"run.num_threads=4"}));
  for (const char* images : {"redrawn", "kept"}) {
    SCOPED_TRACE(images);
    const ExactRun device =
        run_exactly(exact_config("cuda", {"train.graphs=off", std::string("train.images=") + images}));
    EXPECT_EQ(device.graph_launches, 0);
    test::expect_same_driving(host, device);
    test::expect_same_order(host, device);
  }
}

TEST_F(DeviceExact, GraphsAndCallsDriveIdentically) {
  const ExactRun calls = run_exactly(exact_config("cuda", {"train.graphs=off"}));
  for (const char* images : {"redrawn", "kept"}) {
    SCOPED_TRACE(images);
    const ExactRun graphs =
        run_exactly(exact_config("cuda", {"train.graphs=auto", std::string("train.images=") + images}));
    EXPECT_GT(graphs.graph_launches, 500);
    test::expect_same_driving(calls, graphs);
  }
}

/// Updates of a small network, with their costs.
struct Learnt {
  std::vector<std::string> policies;           // hashes, after each update
  std::vector<double> losses;                  // all logged losses, after each update
  std::vector<double> teacher_kl, scene;       // after each update
  std::vector<int64_t> collecting, improving;  // launches of graphs, in each update
  std::vector<int64_t> allocations;            // allocations of device memory, in each update
};

Learnt learn(const std::vector<std::string>& more) {
  std::vector<std::string> overrides{
      "run.device=cuda",         "render.backend=auto",       "render.width_px=32",      "render.height_px=18",
      "simulator.num_slots=700", "simulator.min_agents=8",    "simulator.max_agents=32", "simulator.episode_steps=40",
      "train.num_steps=12",      "train.minibatch_size=2048", "train.forward_chunk=512", "train.schedule=constant",
      "train.reproducible=true"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  const Config config = load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", overrides);
  const Device device = open_learning_device(config);
  set_float32_products(config.train.precision);
  set_reproducible(config.train.reproducible);
  Run run(config, device);
  run.simulator->reset();
  Collector collector(&run);
  const auto allocations = [&] {
    const auto index = torch_device(device).index();
    return at::getDeviceAllocator(at::kCUDA)->getDeviceStats(index).num_device_alloc + device_allocations;
  };
  Learnt learnt;
  for (; run.update < 6; ++run.update, run.agent_steps += run.rollout.actions.numel()) {
    const auto launches = [&] { return run.graphs.num_launches() + collector.num_graph_launches(); };
    const int64_t launches_before = launches(), allocated = allocations();
    EXPECT_TRUE(collector.collect());
    const int64_t launches_between = launches();
    const UpdateStats stats = run.update_policy();
    learnt.collecting.push_back(launches_between - launches_before);
    learnt.improving.push_back(launches() - launches_between);
    learnt.policies.push_back(run.policy->hash());
    for (const double loss : {stats.all.policy_loss, stats.all.value_loss, stats.all.entropy, stats.all.approx_kl,
                              stats.all.grad_norm, stats.gradient_norms.policy}) {
      learnt.losses.push_back(loss);
    }
    learnt.teacher_kl.push_back(stats.all.teacher_kl);
    learnt.scene.push_back(stats.all.scene);
    learnt.allocations.push_back(allocations() - allocated);
  }
  return learnt;
}

class DeviceGraphs : public DeviceExact, public testing::WithParamInterface<std::tuple<const char*, const char*>> {};
INSTANTIATE_TEST_SUITE_P(All, DeviceGraphs,
                         ::testing::Combine(::testing::Values("vector", "perspective"),
                                            ::testing::Values("fp32", "tf32", "bf16")),
                         [](const auto& pair) {
                           return std::string(std::get<0>(pair.param)) + "_" + std::get<1>(pair.param);
                         });

TEST_P(DeviceGraphs, TrainBitwiseIdenticallyToCalls) {
  const auto [modality, precision] = GetParam();
  const std::vector<std::string> more{std::string("policy.modality=") + modality,
                                      std::string("train.precision=") + precision};
  std::vector<std::string> off = more;
  off.push_back("train.graphs=off");
  const Learnt calls = learn(off), graphs = learn(more);
  EXPECT_EQ(graphs.policies, calls.policies);
  EXPECT_EQ(graphs.losses, calls.losses);
  EXPECT_EQ(calls.collecting, std::vector<int64_t>(6, 0));
  EXPECT_EQ(calls.improving, std::vector<int64_t>(6, 0));
  // Memory is settled in the last step of the first rollout; after it comes the final observation.
  EXPECT_LE(graphs.collecting.front(), 2);
  for (size_t update = 3; update < 6; ++update) {
    // Each step has its record, its simulation, and one or two chunks, each with observation and policy output.
    EXPECT_GE(graphs.collecting[update], 13 + 12 + 13 * 2) << update;
    // Each chunk but the first has its observation, its losses and their gradients.
    EXPECT_GT(graphs.improving[update], 3 * 4) << update;
  }
  EXPECT_NE(calls.policies[5], calls.policies[0]);
}

TEST_F(DeviceExact, GraphsAndCallsTrainIdenticallyWithAndAfterATeacher) {
  const test::ScratchFolder folder;
  const std::string teacher = folder / "teacher.safetensors";
  const Config config = load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", {"policy.modality=vector", "run.seed=5"});
  write_policy(teacher, pictura::Run(config, Device{}).saved_policy(), WeightType::f32, "");
  for (const int scene_coef : {0, 1}) {
    SCOPED_TRACE(scene_coef);
    // Scheduled for 8,400 agent-steps per update.
    const std::vector<std::string> more{"train.precision=bf16", "train.teacher=" + teacher,
                                        "train.teacher_agent_steps=25000",
                                        fmt::format("train.teacher_scene_coef={}", scene_coef)};
    std::vector<std::string> off = more;
    off.push_back("train.graphs=off");
    const Learnt calls = learn(off), graphs = learn(more);
    EXPECT_EQ(graphs.policies, calls.policies);
    EXPECT_EQ(graphs.losses, calls.losses);
    EXPECT_GT(calls.teacher_kl.front(), 0);
    EXPECT_EQ(calls.teacher_kl.back(), 0);
    EXPECT_EQ(calls.scene.front() > 0 && calls.scene.back() > 0, scene_coef > 0);
    EXPECT_EQ(graphs.scene, calls.scene);
    EXPECT_GT(graphs.improving.back(), 3 * 4);
  }
}

TEST_P(DeviceGraphs, AllocateNothingAfterAllSizesWereCaptured) {
  const auto [modality, precision] = GetParam();
  const Learnt graphs = learn({std::string("policy.modality=") + modality, std::string("train.precision=") + precision,
                               "simulator.reset_inactive_fraction=2", "simulator.episode_steps=1000"});
  EXPECT_GT(graphs.allocations.front(), 0);
  EXPECT_EQ(graphs.allocations.back(), 0);
}

TEST_F(DeviceExact, CaptureErrorsNameTheKey) {
  const Config config = exact_config("cuda", {});
  const Device device = open_learning_device(config);
  const OwnStream stream(device);
  Graphs graphs(device, /*are_used=*/true);
  const at::Tensor number = at::ones({4}, at::TensorOptions(at::kFloat).device(torch_device(device)));
  RepeatedWork work;
  const auto wait = [&] { return number.sum().item<float>(); };
  std::string message;
  stream.run([&] {
    work.run(&graphs, wait);
    try {
      work.run(&graphs, wait);
    } catch (const Error& error) {
      message = error.what();
    }
  });
  EXPECT_NE(message.find("train.graphs"), std::string::npos) << message;
  // The device's state is unchanged.
  RepeatedWork doubles;
  stream.run([&] {
    for (int i = 0; i < 3; ++i) doubles.run(&graphs, [&] { number.mul_(2); });
  });
  EXPECT_TRUE(number.eq(8).all().item<bool>());
  EXPECT_EQ(graphs.num_launches(), 2);
}

}  // namespace
}  // namespace pictura
