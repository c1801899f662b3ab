// Growth of convolutions to more channels: exported files, and the function before and after.
#include "pictura/policy/wider_convolutions.h"

#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/policy/export_policy.h"
#include "pictura/policy/policy.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/tests/policy/numbers.h"
#include "pictura/tests/policy/small_policy.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::HasSubstr;

class WiderConvolutions : public ::testing::Test {
 protected:
  static Config config(bool has_norm) {
    Config c;
    c.render.width_px = 16;
    c.render.height_px = 9;
    c.policy = test::tiny_section(Modality::perspective);
    c.policy.patch_px = 2;
    c.policy.conv_channels = {8, 4, 8};
    c.policy.conv_kernels = {1, 3, 3};
    c.policy.conv_strides = {1, 2, 1};
    c.policy.conv_norm = has_norm;
    return c;
  }
  SavedPolicy write(const Config& config) {
    SavedPolicy saved;
    saved.config = config;
    saved.rig = paper_rig(16, 9);
    const PolicyNetwork policy(config.policy, 4, 1);
    for (const NamedTensor& parameter : policy.parameters()) {
      const at::NoGradGuard no_grad;
      // Biases are 0 at first.
      if (parameter.name.ends_with("bias"))
        at::Tensor(parameter.value).copy_(test::numbers(parameter.value.sizes(), 5));
    }
    saved.parameters = policy.parameters();
    write_policy(path_, saved, WeightType::f32, "");
    return read_policy(path_);
  }
  SavedPolicy widened(const std::vector<int>& channels) {
    const std::string wide = folder_ / "wide.safetensors";
    export_policy(path_, wide, {.weights = WeightType::f32, .channels = channels});
    return read_policy(wide);
  }
  static at::Tensor logits(const SavedPolicy& saved) {
    const PolicyNetwork policy(saved.config.policy, 4, 1);
    restore_policy(saved, policy);
    Observation o;
    o.ego = test::numbers({3, kEgoFeatures}, 0).to(at::kFloat);
    o.conditioning = test::numbers({3, kNumConditioning}, 1).to(at::kFloat);
    o.waypoints = test::numbers({3, kNumWaypoints * kWaypointFeatures}, 2).to(at::kFloat);
    o.images = {{(test::numbers({3, 4, 3, 9, 16}, 3) * 120 + 128).to(at::kByte), {0, 1, 2, 3}}};
    const at::NoGradGuard no_grad;
    return policy.forward(o).logits;
  }

  test::ScratchFolder folder_;
  const std::string path_ = folder_ / "narrow.safetensors";
};

TEST_F(WiderConvolutions, KeepTheOutputs) {
  for (const bool has_norm : {false, true}) {
    SCOPED_TRACE(has_norm);
    const SavedPolicy narrow = write(config(has_norm)), wide = widened({16, 12, 8});
    EXPECT_EQ(wide.config.policy.conv_channels, (std::vector<int>{16, 12, 8}));
    EXPECT_LT((logits(wide) - logits(narrow)).abs().max().item<double>(), 1e-5);
    EXPECT_GT(logits(narrow).std().item<double>(), 1e-4);
    // Copies of a channel are equal, and the weights behind them are not, so that gradients differ.
    const auto parameter = [&](const char* name) {
      return std::ranges::find(wide.parameters, name, &NamedTensor::name)->value;
    };
    const at::Tensor first = parameter("conv.0.weight"), second = parameter("conv.1.weight");
    EXPECT_TRUE(first.narrow(0, 0, 8).equal(first.narrow(0, 8, 8)));
    const at::Tensor shares = second.narrow(1, 0, 8) / (second.narrow(1, 0, 8) + second.narrow(1, 8, 8));
    EXPECT_GT(shares.min().item<double>(), 0.29);
    EXPECT_LT(shares.max().item<double>(), 0.71);
    EXPECT_GT(shares.std().item<double>(), 0.05);
    EXPECT_TRUE(second.narrow(0, 0, 4).equal(second.narrow(0, 8, 4)));
  }
}

TEST_F(WiderConvolutions, RefuseOtherChannels) {
  write(config(false));
  const auto refusal = [this](const std::vector<int>& channels) { return message_of([&] { widened(channels); }); };
  for (const std::vector<int>& channels : {std::vector{16, 8}, {16, 6, 8}, {4, 4, 8}, {8, 4, 16}, {8192, 4, 8}}) {
    EXPECT_THAT(refusal(channels),
                HasSubstr("channels: expected multiples of 8, 4, 8, up to 4096, and the last one unchanged"));
  }
  Config vector = config(false);
  vector.policy.modality = Modality::vector;
  write(vector);
  EXPECT_THAT(refusal({16, 4, 8}), HasSubstr("channels: its policy reads no images"));
}

}  // namespace
}  // namespace pictura
