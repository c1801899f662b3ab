// Adaptation of the first convolution to larger images: weights compared with values computed by hand, the function
// before and after a step, and exported files.
#include "pictura/policy/patch_spread.h"

#include <ATen/core/grad_mode.h>
#include <gmock/gmock.h>

#include "pictura/common/error.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/policy/session.h"
#include "pictura/tests/policy/numbers.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/training/checkpoint.h"
#include "pictura/training/optimizer.h"
#include "pictura/training/patch_growth.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

PolicySection small_section(int patch_px) {
  PolicySection c;
  c.patch_px = patch_px;
  c.conv_channels = {8, 8};
  c.conv_kernels = {1, 3};
  c.conv_strides = {1, 2};
  c.num_queries = 2;
  c.attention_heads = 2;
  c.attention_mlp = 8;
  c.embedding_width = 8;
  c.backbone_layers = 2;
  c.backbone_width = 16;
  return c;
}

TEST(PatchSpread, PutsSharesOfAWeightAtThePlacesOfItsPixel) {
  EXPECT_EQ(patch_side_px(3), 1);
  EXPECT_EQ(patch_side_px(432), 12);
  EXPECT_THAT(message_of([] { patch_side_px(50); }), HasSubstr("conv.0.weight: expected 3 p^2 inputs"));
  constexpr int kPatch = 2, kFactor = 3, kLarge = kPatch * kFactor;
  const at::Tensor weight = test::numbers({2, 3 * kPatch * kPatch, 3, 3}, 1).to(at::kFloat);
  const at::Tensor spread = spread_over_patches(weight, kFactor), repeated = repeat_over_patches(weight, kFactor);
  ASSERT_EQ(spread.sizes().vec(), (std::vector<int64_t>{2, 3 * kLarge * kLarge, 3, 3}));
  for (int color = 0; color < 3; ++color) {
    for (int y = 0; y < kLarge; ++y) {
      for (int x = 0; x < kLarge; ++x) {
        const at::Tensor from = weight.select(1, (color * kPatch + y / kFactor) * kPatch + x / kFactor);
        const int64_t to = (color * kLarge + y) * kLarge + x;
        EXPECT_TRUE(at::allclose(spread.select(1, to), from / 9, 1e-7, 0)) << color << y << x;
        EXPECT_TRUE(repeated.select(1, to).equal(from)) << color << y << x;
      }
    }
  }
  EXPECT_TRUE(spread_over_patches(weight, 1).equal(weight));
}

// Observations of an agent whose images are constant in blocks of pixels x pixels: 7x5 blocks, which patches of two
// blocks do not divide.
Observation blocks_of(int64_t pixels) {
  constexpr int64_t kBatch = 6;
  Observation o;
  o.ego = test::numbers({kBatch, kEgoFeatures}, 0).to(at::kFloat);
  o.conditioning = test::numbers({kBatch, kNumConditioning}, 1).to(at::kFloat);
  o.waypoints = test::numbers({kBatch, kNumWaypoints * kWaypointFeatures}, 2).to(at::kFloat);
  const at::Tensor bytes = (test::numbers({kBatch, 3, 3, 5, 7}, 3) * 120 + 128).to(at::kByte);
  o.images = {{bytes.repeat_interleave(pixels, 3).repeat_interleave(pixels, 4), {0, 1, 2}}};
  return o;
}

struct GrowingPolicy {
  explicit GrowingPolicy(double its_max_grad_norm)
      : max_grad_norm(its_max_grad_norm), policy(small_section(2), 3, 1), optimizer(policy, {.weight_decay = 0.1}) {}
  at::Tensor logits() const {
    const at::NoGradGuard no_grad;
    return policy.forward(blocks_of(pixels)).logits;
  }
  void step() {
    const Policy::Output output = policy.forward(blocks_of(pixels));
    const at::Tensor targets = test::numbers(output.logits.sizes(), 9).to(at::kFloat);
    const at::Tensor loss = (at::log_softmax(output.logits, 1) * targets).sum() + output.value.square().sum();
    loss.backward();
    const at::Tensor gradient_norm = optimizer.gradient_norm();
    optimizer.gradients().mul_((max_grad_norm / gradient_norm).clamp_max(1.0));
    optimizer.step(1e-2, at::zeros({}));
    norm = gradient_norm.item<double>();
  }
  void grow(int factor) {
    spread_first_convolution(policy, factor, &optimizer);
    pixels *= factor;
  }
  const double max_grad_norm;
  int pixels = 1;
  double norm = 0;  // norm of the last step's gradient
  PolicyNetwork policy;
  Optimizer optimizer;
};

double largest_difference(const at::Tensor& a, const at::Tensor& b) { return (a - b).abs().max().item<double>(); }

void expect_equal_learning(double max_grad_norm) {
  GrowingPolicy small(max_grad_norm), large(max_grad_norm), at_whole_rate(max_grad_norm);
  for (GrowingPolicy* each : {&small, &large, &at_whole_rate}) {
    each->step();
    each->step();
  }
  for (GrowingPolicy* each : {&large, &at_whole_rate}) {
    each->grow(3);
    EXPECT_LT(largest_difference(each->logits(), small.logits()), 1e-5);
  }
  EXPECT_EQ(large.optimizer.rate_factors.front(), 1.0 / 9);
  EXPECT_EQ(large.optimizer.gradients().size(0), large.policy.num_parameters());
  at_whole_rate.optimizer.rate_factors.front() = 1;
  const at::Tensor before = small.logits();
  for (GrowingPolicy* each : {&small, &large, &at_whole_rate}) each->step();
  EXPECT_GT(small.norm, 0.1);
  EXPECT_NEAR(large.norm, small.norm, 1e-4 * small.norm);
  EXPECT_GT(at_whole_rate.norm, 1.01 * small.norm);
  EXPECT_GT(largest_difference(small.logits(), before), 1e-2);
  EXPECT_LT(largest_difference(large.logits(), small.logits()), 1e-5);
  EXPECT_GT(largest_difference(at_whole_rate.logits(), small.logits()), 1e-3);
}

TEST(PatchSpread, KeepsLogitsAndTheEffectOfAStep) { expect_equal_learning(1e9); }

TEST(PatchSpread, KeepsTheEffectOfAClippedStep) { expect_equal_learning(0.1); }

class ExportedSize : public ::testing::Test {
 protected:
  // Writes a policy of 16x9 px in patches of 2, for exports.
  std::string write(const Config& config) {
    SavedPolicy saved;
    saved.config = config;
    saved.rig = paper_rig(16, 9);
    saved.update = 5;
    const PolicyNetwork policy(config.policy, 4, 1);
    saved.parameters = policy.parameters();
    write_policy(folder_ / "small.safetensors", saved, WeightType::f32, "");
    return folder_ / "small.safetensors";
  }
  static Config config() {
    Config c;
    c.policy = small_section(2);
    c.render.width_px = 4;  // the run began with another size
    c.render.height_px = 3;
    c.render.schedule = {{10, 16, 9}};
    return c;
  }
  SavedPolicy resized(const std::string& from, const std::string& to, ImageSize size) {
    export_policy(from, folder_ / to, {.weights = WeightType::f32, .size = size});
    return read_policy(folder_ / to);
  }
  std::string refusal(const std::string& from, ImageSize size) {
    return message_of([&] { resized(from, "none.safetensors", size); });
  }
  test::ScratchFolder folder_;
};

TEST_F(ExportedSize, SpreadsTheFirstConvolutionOfAFile) {
  const SavedPolicy small = read_policy(write(config())), large = resized(small.path, "large.safetensors", {48, 27}),
                    again = resized(large.path, "again.safetensors", {96, 54});
  EXPECT_EQ(large.config.policy.patch_px, 6);
  EXPECT_EQ(large.config.render.line_floor_px, 1.05);
  EXPECT_EQ(large.config.render.width_px, 48);
  EXPECT_TRUE(large.config.render.schedule.empty());
  EXPECT_EQ(first_difference(large.rig, paper_rig(48, 27)), "");
  EXPECT_EQ(large.update, 5);
  EXPECT_EQ(large.rate_factors, (std::map<std::string, double>{{kFirstConvolution, 1.0 / 9}}));
  EXPECT_EQ(again.config.policy.patch_px, 12);
  EXPECT_EQ(again.config.render.line_floor_px, 2.1);
  EXPECT_EQ(again.rate_factors.at(kFirstConvolution), 1.0 / 9 / 4);
  ASSERT_EQ(large.parameters.size(), small.parameters.size());
  for (size_t i = 0; i < small.parameters.size(); ++i) {
    const NamedTensor &before = small.parameters[i], &after = large.parameters[i];
    const bool is_first = before.name == kFirstConvolution;
    EXPECT_TRUE(after.value.equal(is_first ? spread_over_patches(before.value, 3) : before.value)) << before.name;
  }
  EXPECT_EQ(PolicySession(large.path, {.device = "cpu"}).rig().cameras[0].width_px, 48);
  EXPECT_TRUE(resized(small.path, "same.safetensors", {16, 9}).rate_factors.empty());
}

TEST_F(ExportedSize, RefusesUnsupportedSizes) {
  const std::string path = write(config());
  EXPECT_THAT(refusal(path, {40, 27}),
              AllOf(HasSubstr(path), HasSubstr("size: expected an integer multiple of 16x9, got 40x27")));
  EXPECT_THAT(refusal(path, {32, 27}), HasSubstr("got 32x27"));
  EXPECT_THAT(refusal(path, {8, 4}), HasSubstr("got 8x4"));
  EXPECT_THAT(refusal(path, {160, 90}), HasSubstr("expected patches of at most 16 px"));
  Config vector = config();
  vector.policy.modality = Modality::vector;
  vector.render.schedule.clear();
  EXPECT_THAT(refusal(write(vector), {32, 18}), HasSubstr("size: its policy reads no images"));
  Config with_rig = config();
  with_rig.render.schedule.clear();
  with_rig.render.rig = "cameras.toml";
  EXPECT_THAT(refusal(write(with_rig), {32, 18}), HasSubstr("the cameras of cameras.toml"));
}

}  // namespace
}  // namespace pictura
