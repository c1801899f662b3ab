// Policies that the host computes without torch, compared with torch: released policies in simulated worlds, and small
// policies of every architecture.
#include "pictura/policy/host_network.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/map/load_map.h"
#include "pictura/policy/host_product.h"
#include "pictura/policy/policy.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/policy/session_parts.h"
#include "pictura/tests/policy/numbers.h"
#include "pictura/tests/policy/small_policy.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::message_of;
using test::numbers;
using ::testing::HasSubstr;

// Relative tolerance of logits and values: those of released policies reach 400, where fp32 has steps of 3e-5.
constexpr double kTolerance = 1e-4;

double largest_difference(const std::vector<float>& got, const std::vector<float>& expected) {
  double largest = 0, size = 1;
  for (size_t i = 0; i < got.size(); ++i) {
    largest = std::max(largest, std::abs(double{got[i]} - double{expected[i]}));
    size = std::max(size, std::abs(double{expected[i]}));
  }
  return largest / size;
}

TEST(HostProduct, IsTheSumOfProductsAtAnySizeAndWidth) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> number(-1, 1);
  for (const auto& [rows, inner, columns] :
       {std::array{1, 1, 1}, std::array{7, 5, 3}, std::array{6, 64, 32}, std::array{13, 33, 61}}) {
    std::vector<float> a(static_cast<size_t>(rows * inner)), b(static_cast<size_t>(inner * columns));
    for (std::vector<float>* numbers : {&a, &b})
      std::generate(numbers->begin(), numbers->end(), [&] { return number(random); });
    std::vector<float> out(static_cast<size_t>(rows * columns)), again(out.size()), one(static_cast<size_t>(columns));
    // The matrix as it is, and transposed.
    host::multiply({a.data(), 1, rows}, b.data(), rows, inner, columns, out.data(), /*is_wide=*/false);
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) {
        double sum = 0;
        for (int i = 0; i < inner; ++i) sum += double{a[i * rows + r]} * double{b[i * columns + c]};
        EXPECT_NEAR(out[r * columns + c], sum, 1e-5);
      }
      host::multiply({a.data() + r, 1, rows}, b.data(), 1, inner, columns, one.data());
      EXPECT_TRUE(std::equal(one.begin(), one.end(), out.begin() + r * columns)) << "row " << r << " alone";
    }
    host::multiply({a.data(), 1, rows}, b.data(), rows, inner, columns, again.data());
    EXPECT_EQ(again, out);
  }
}

// Both sessions of a policy in one world.
class ReleasedPolicy : public ::testing::TestWithParam<const char*> {
 protected:
  ReleasedPolicy()
      : path_(std::string(PICTURA_SOURCE_DIR "/models/") + GetParam() + ".safetensors"),
        torch_(open_torch_session(path_, {.num_threads = 1, .device = "cpu"})),
        host_(open_host_session(path_, {.num_threads = 2, .device = "cpu"})) {
    SimulatorConfig config = torch_.training_world();
    config.seed = 7;
    simulator_ = make_simulator("cpu", config, {load_map("procedural:3")}, {{0, 12, 0}, {0, 12, 1}});
    renderer_ = torch_.make_renderer();
    if (renderer_) upload_maps(*simulator_, renderer_.get());
    simulator_->reset();
  }

  PolicyInput input() const {
    return {.observations = simulator_->observations(), .scene = &simulator_->scene(), .views = simulator_->views()};
  }
  struct Outputs {
    std::vector<float> logits, values;
  };
  Outputs outputs(PolicySession* session, const PolicyInput& input) const {
    const auto batch = static_cast<size_t>(simulator_->num_slots());
    Outputs result{std::vector<float>(batch * kNumActions), std::vector<float>(batch)};
    session->evaluate(input, renderer_.get(), result.logits, result.values);
    return result;
  }
  void expect_equal_outputs(const PolicyInput& input) {
    const Outputs expected = outputs(&torch_, input), got = outputs(&host_, input);
    EXPECT_LT(largest_difference(got.logits, expected.logits), kTolerance);
    EXPECT_LT(largest_difference(got.values, expected.values), kTolerance);
  }

  std::string path_;
  PolicySession torch_, host_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<Renderer> renderer_;
};

TEST_P(ReleasedPolicy, GivesTheLogitsAndActionsOfTorchWithoutIt) {
  EXPECT_EQ(host_.policy_hash(), torch_.policy_hash());
  const auto by_torch = torch_.make_controller(renderer_.get(), /*argmax=*/false, 5),
             by_host = host_.make_controller(renderer_.get(), /*argmax=*/false, 5);
  const auto slots = static_cast<size_t>(simulator_->num_slots());
  std::vector<Command> commands(slots), expected(slots);
  int different = 0;
  constexpr int kSteps = 24;
  for (int step = 0; step < kSteps; ++step) {
    if (step % 8 == 0) expect_equal_outputs(input());
    by_torch->act(simulator_->arrays(), {}, expected);
    by_host->act(simulator_->arrays(), {}, commands);
    EXPECT_EQ(by_host->num_driven(), by_torch->num_driven());
    for (size_t i = 0; i < slots; ++i) different += commands[i].action != expected[i].action;
    simulator_->step(expected);
  }
  // A draw between two actions may fall to either side.
  EXPECT_LE(different, kSteps * static_cast<int>(slots) / 500);
}

TEST_P(ReleasedPolicy, MatchesTorchWithHiddenAndUndrawnInputs) {
  PolicyInput asked = input();
  asked.hides_auxiliary = true;
  expect_equal_outputs(asked);
  std::vector<uint8_t> is_drawn(static_cast<size_t>(simulator_->num_slots()));
  for (size_t i = 0; i < is_drawn.size(); ++i) is_drawn[i] = i % 3 == 1;
  asked.is_drawn = is_drawn;
  expect_equal_outputs(asked);
}

TEST_P(ReleasedPolicy, HoldsActionsAsTorchDoes) {
  const SessionOptions options{.num_threads = 1, .device = "cpu", .decision_steps = 3};
  PolicySession torch(open_torch_session(path_, options)), host(open_host_session(path_, options));
  const auto by_torch = torch.make_controller(renderer_.get(), /*argmax=*/true, 5),
             by_host = host.make_controller(renderer_.get(), /*argmax=*/true, 5);
  const auto slots = static_cast<size_t>(simulator_->num_slots());
  std::vector<Command> commands(slots), expected(slots);
  std::vector<int32_t> before;
  int different = 0, changed = 0;
  for (int step = 0; step < 12; ++step) {
    by_torch->act(simulator_->arrays(), {}, expected);
    by_host->act(simulator_->arrays(), {}, commands);
    for (size_t i = 0; i < slots; ++i) {
      different += commands[i].action != expected[i].action;
      changed += step > 0 && step % 3 != 0 && commands[i].action != before[i];
    }
    before.clear();
    for (const Command& command : commands) before.push_back(command.action);
    simulator_->step(expected);
    if (step == 6) simulator_->reset();  // all episodes restart, and all agents decide at once
  }
  EXPECT_EQ(different, 0);
  EXPECT_GT(changed, 0);
  EXPECT_LT(changed, static_cast<int>(slots) * 3);
}

INSTANTIATE_TEST_SUITE_P(Models, ReleasedPolicy, ::testing::Values("perspective", "vector", "vector_auxiliary"),
                         [](const auto& model) { return model.param; });

TEST(ReleasedPolicies, AreAllTested) {
  size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(PICTURA_SOURCE_DIR "/models")) {
    files += entry.path().extension() == ".safetensors";
  }
  EXPECT_EQ(files, 3U);
}

// A network with weights as they are drawn, as torch and as the host compute it.
void expect_equal_networks(const Config& config) {
  constexpr int64_t kBatch = 21;
  const bool sees = config.reads_images();
  const PolicyNetwork network(config.policy, 3, 1, at::kFloat, config.reads(ObservationPart::walls));
  StoredPolicy saved{{.path = "small", .config = config}, to_stored(network.parameters())};
  for (StoredTensor& parameter : saved.parameters) {
    // Biases begin as zeros, which would hide where they are added.
    if (!parameter.name.ends_with("bias")) continue;
    for (size_t i = 0; i < parameter.values.size(); ++i) parameter.values[i] += 0.1f * static_cast<float>(std::sin(i));
  }
  restore_tensors("small", to_tensors(saved.parameters), network.parameters());

  Observation o;
  HostObservation host{.agents = kBatch, .arrays = {}, .images = {}};
  const auto all = [](int64_t columns, double phase) { return numbers({kBatch, columns}, phase).to(at::kFloat); };
  const auto span_of = [](const at::Tensor& t) {
    return Span<float>(t.data_ptr<float>(), static_cast<size_t>(t.numel()));
  };
  host.arrays.ego = span_of(o.ego = all(kEgoFeatures, 0));
  host.arrays.conditioning = span_of(o.conditioning = all(kNumConditioning, 1));
  host.arrays.waypoints = span_of(o.waypoints = all(kNumWaypoints * kWaypointFeatures, 2));
  const auto set = [&](at::Tensor* to, Span<float>* view, int64_t rows, int64_t features, double phase) {
    *view = span_of(*to = all(rows * features, phase).unflatten(1, {rows, features}));
  };
  if (sees) {
    for (const auto& [cameras, height, width] :
         {std::tuple(std::vector<int>{0, 2}, 13, 18), {std::vector<int>{1}, 9, 10}}) {
      const auto count = static_cast<int64_t>(cameras.size());
      const at::Tensor pixels = (numbers({kBatch, count, 3, height, width}, 3) * 120 + 128).to(at::kByte);
      o.images.push_back({pixels, {cameras.begin(), cameras.end()}});
      host.images.push_back({pixels.data_ptr<uint8_t>(), height, width, cameras});
    }
  } else {
    set(&o.partners, &host.arrays.partners, kMaxPartners, kPartnerFeatures, 3);
    set(&o.lanes, &host.arrays.lanes, kMaxLanes, kLaneFeatures, 4);
    set(&o.boundaries, &host.arrays.boundaries, kMaxBoundaries, kBoundaryFeatures, 5);
    set(&o.controls, &host.arrays.controls, kMaxControls, kControlFeatures, 6);
    set(&o.walls, &host.arrays.walls, kMaxWalls, kWallFeatures, 7);
    o.set_counts = at::tensor({3, 80, 5, 0, 4, 0, 7, 80, 10, 80}, at::kInt)
                       .view({2, 5})
                       .repeat({11, 1})
                       .narrow(0, 0, kBatch)
                       .contiguous();
    host.arrays.set_counts = {o.set_counts.data_ptr<int32_t>(), static_cast<size_t>(o.set_counts.numel())};
  }
  const at::NoGradGuard no_grad;
  const Policy::Output expected = network.forward(o);
  std::vector<float> logits(kBatch * kNumActions), values(kBatch);
  HostNetwork(saved, 3).forward(host, 2, logits.data(), values.data());
  const auto values_of = [](const at::Tensor& t) {
    const at::Tensor dense = t.contiguous();
    return std::vector<float>(dense.const_data_ptr<float>(), dense.const_data_ptr<float>() + dense.numel());
  };
  EXPECT_LT(largest_difference(logits, values_of(expected.logits)), 1e-5);
  EXPECT_LT(largest_difference(values, values_of(expected.value)), 1e-5);
}

TEST(HostNetwork, ComputesEveryArchitecture) {
  for (const Modality modality : {Modality::perspective, Modality::vector}) {
    for (int choice = 0; choice < 16; ++choice) {
      SCOPED_TRACE(choice);
      Config config;
      config.policy = test::tiny_section(modality);
      config.policy.layer_norm = choice & 1;
      config.policy.residual = choice & 2;
      config.policy.conv_norm = choice & 2;
      config.policy.point_features = choice & 4;
      config.policy.segment_features = !(choice & 1);
      config.policy.attention_mlp = choice & 2 ? 0 : 5;
      config.policy.concatenate_queries = choice & 8;
      config.policy.patch_px = choice + 1;
      config.simulator.walls = choice & 4;
      config.policy.backbone_layers = 1 + choice % 3;
      expect_equal_networks(config);
    }
  }
}

TEST(HostNetwork, RefusesUnsupportedPolicies) {
  Config config;
  config.policy = test::tiny_section(Modality::vector);
  const PolicyNetwork network(config.policy, 3, 1);
  const StoredPolicy saved{{.path = "a.safetensors", .config = config}, to_stored(network.parameters())};
  const auto refusal = [](const StoredPolicy& policy) { return message_of([&] { HostNetwork(policy, 3); }); };
  EXPECT_EQ(refusal(saved), test::kNoError);
  StoredPolicy other = saved;
  other.config.policy.backbone_width = 7;
  EXPECT_THAT(refusal(other),
              HasSubstr("a.safetensors: has a different architecture: parameter 'backbone.0.weight': expected [7, "));
  other = saved;
  other.parameters.back().values[0] = NAN;
  EXPECT_THAT(refusal(other), HasSubstr("parameter 'critic.bias': expected finite numbers"));
  other = saved;
  other.parameters.push_back({"more", {1}, {0}});
  EXPECT_THAT(refusal(other), HasSubstr("expected 32 parameters, got 33"));
  other = saved;
  other.backbone_hash = "0123456789abcdef";
  EXPECT_THAT(refusal(other), HasSubstr("which needs torch"));
}

}  // namespace
}  // namespace pictura
