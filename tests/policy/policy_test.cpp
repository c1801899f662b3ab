// Policies: shapes, gradients, masks and initialisation.
#include "pictura/policy/policy.h"

#include <cmath>

#include <ATen/Parallel.h>
#include <ATen/core/grad_mode.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/policy/layers.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/tests/policy/numbers.h"
#include "pictura/tests/policy/small_policy.h"

namespace pictura {
namespace {

using test::numbers;
using test::tiny_section;

Observation observation(Modality modality, int64_t batch) {
  Observation o;
  o.ego = numbers({batch, kEgoFeatures}, 0);
  o.conditioning = numbers({batch, kNumConditioning}, 1);
  o.waypoints = numbers({batch, kNumWaypoints * kWaypointFeatures}, 2);
  if (modality == Modality::vector) {
    o.partners = numbers({batch, kMaxPartners, kPartnerFeatures}, 3);
    o.lanes = numbers({batch, kMaxLanes, kLaneFeatures}, 4);
    o.boundaries = numbers({batch, kMaxBoundaries, kBoundaryFeatures}, 5);
    o.controls = numbers({batch, kMaxControls, kControlFeatures}, 6);
    o.walls = numbers({batch, kMaxWalls, kWallFeatures}, 7);
    o.set_counts = at::tensor({3, 80, 5, 0, 4, 0, 7, 80, 10, 80}, at::kInt)
                       .reshape({2, kNumEntitySets})
                       .repeat({(batch + 1) / 2, 1})
                       .narrow(0, 0, batch);
  } else {
    // Two sizes in one rig: cameras 0 and 2 are 8x6, camera 1 is 5x4.
    auto bytes = [](at::IntArrayRef shape, double phase) { return (numbers(shape, phase) * 120 + 128).to(at::kByte); };
    o.images = {{bytes({batch, 2, 3, 6, 8}, 7), {0, 2}}, {bytes({batch, 1, 3, 4, 5}, 8), {1}}};
  }
  return o;
}

// A scalar that depends on every output.
double scalar_of(const Policy& policy, const Observation& o, bool with_gradient) {
  const at::AutoGradMode mode(with_gradient);
  const Policy::Output output = policy.forward(o);
  const at::Tensor weights = numbers(output.logits.sizes(), 9);
  const at::Tensor loss = (at::log_softmax(output.logits, 1) * weights).sum() + (output.value * output.value).sum();
  if (with_gradient) loss.backward();
  return loss.item<double>();
}

// Images as u8, and as the patches that renderers draw.
TEST(PolicyPatches, GiveTheSameBitsAsImages) {
  PolicySection config = tiny_section(Modality::perspective);
  config.conv_kernels = {1, 3};
  const Observation images = observation(Modality::perspective, 3).map([](const at::Tensor& t) {
    return t.scalar_type() == at::kByte ? t : t.to(at::kFloat);
  });
  const at::NoGradGuard no_grad;
  for (const int patch_px : {4, 8, 12, 16}) {
    config.patch_px = patch_px;
    const PolicyNetwork policy(config, 3, 1, at::kFloat, false, {}, Precision::bf16);
    ASSERT_EQ(policy.drawn_patch_px(), patch_px);
    Observation patches = images;
    for (ImageBlock& block : patches.images) {
      const int64_t batch = block.pixels.size(0), cameras = block.pixels.size(1);
      block.pixels = image_patches(block.pixels, patch_px, at::kBFloat16)
                         .permute({0, 2, 3, 1})
                         .unflatten(0, {cameras, batch})
                         .transpose(0, 1);
    }
    const Policy::Output expected = policy.forward(images), got = policy.forward(patches);
    EXPECT_TRUE(got.logits.equal(expected.logits)) << patch_px;
    EXPECT_TRUE(got.value.equal(expected.value)) << patch_px;
  }
  for (const int patch_px : {2, 6}) {
    config.patch_px = patch_px;
    EXPECT_EQ(PolicyNetwork(config, 3, 1, at::kFloat, false, {}, Precision::bf16).drawn_patch_px(), 0);
  }
  config.patch_px = 4;
  EXPECT_EQ(PolicyNetwork(config, 3, 1).drawn_patch_px(), 0) << "in single precision";
}

class BothModalities : public ::testing::TestWithParam<Modality> {};
INSTANTIATE_TEST_SUITE_P(Policy, BothModalities, ::testing::Values(Modality::perspective, Modality::vector));

void expect_gradients(const Policy& policy, const Observation& o) {
  scalar_of(policy, o, true);
  const at::NoGradGuard no_grad;
  int64_t checked = 0;
  for (const NamedTensor& parameter : policy.parameters()) {
    ASSERT_TRUE(parameter.value.grad().defined()) << parameter.name;
    double* values = parameter.value.data_ptr<double>();
    const double* gradient = parameter.value.grad().contiguous().const_data_ptr<double>();
    const int64_t stride = std::max<int64_t>(1, parameter.value.numel() / 7);
    for (int64_t i = 0; i < parameter.value.numel(); i += stride, ++checked) {
      const double value = values[i], h = 1e-5;
      values[i] = value + h;
      const double above = scalar_of(policy, o, false);
      values[i] = value - h;
      const double below = scalar_of(policy, o, false);
      values[i] = value;
      EXPECT_NEAR(gradient[i], (above - below) / (2 * h), 1e-6 * (1 + std::abs(gradient[i])))
          << parameter.name << " " << i;
    }
  }
  EXPECT_GT(checked, 100);
}

TEST_P(BothModalities, GradientsEqualDifferenceQuotients) {
  expect_gradients(PolicyNetwork(tiny_section(GetParam()), 3, 5, at::kDouble), observation(GetParam(), 2));
}

TEST(Policy, GradientsOfFeaturesOfSegmentsEqualDifferenceQuotients) {
  PolicySection section = tiny_section(Modality::vector);
  section.segment_features = true;
  expect_gradients(PolicyNetwork(section, 3, 5, at::kDouble, /*reads_walls=*/true), observation(Modality::vector, 2));
}

TEST(Policy, GradientsOfPatchesEqualDifferenceQuotients) {
  PolicySection section = tiny_section(Modality::perspective);
  section.patch_px = 2;
  section.conv_kernels = {1, 3};
  section.conv_strides = {1, 2};
  expect_gradients(PolicyNetwork(section, 3, 5, at::kDouble), observation(Modality::perspective, 2));
}

TEST_P(BothModalities, GradientsOfNormalizedLayersEqualDifferenceQuotients) {
  PolicySection section = tiny_section(GetParam());
  section.layer_norm = section.conv_norm = section.residual = true;
  section.backbone_layers = 3;
  const PolicyNetwork policy(section, 3, 5, at::kDouble);
  expect_gradients(policy, observation(GetParam(), 2));
  section.layer_norm = section.conv_norm = section.residual = false;
  EXPECT_EQ(policy.hash(), PolicyNetwork(section, 3, 5, at::kDouble).hash())
      << "norms and residuals have no parameters";
}

TEST(Policy, GradientsOfConcatenatedQueriesEqualDifferenceQuotients) {
  PolicySection section = tiny_section(Modality::perspective);
  section.concatenate_queries = true;
  for (const int mlp : {section.attention_mlp, 0}) {
    section.attention_mlp = mlp;
    expect_gradients(PolicyNetwork(section, 3, 5, at::kDouble), observation(Modality::perspective, 2));
  }
}

// At any scale of the layers before them, the heads' inputs have a mean of 0 and a variance of 1.
TEST(Policy, HeadsReadNormalizedActivations) {
  PolicySection section = tiny_section(Modality::vector);
  section.layer_norm = true;
  const PolicyNetwork policy(section, 3, 5, at::kDouble);
  const at::NoGradGuard no_grad;
  for (const NamedTensor& parameter : policy.parameters()) {
    at::Tensor value = parameter.value;
    if (parameter.name == "backbone.1.weight") value.mul_(30);
    if (parameter.name == "critic.weight") value.fill_(1);
  }
  EXPECT_LT(policy.forward(observation(Modality::vector, 3)).value.abs().max().item<double>(), 1e-9);
}

// A layer of zeros gives gelu(0) = 0, so that only its input remains.
TEST(Policy, ResidualsPassOverLayersOfTheTrunk) {
  PolicySection section = tiny_section(Modality::vector);
  section.residual = true;
  section.backbone_layers = 1;
  const PolicyNetwork shallow(section, 3, 5, at::kDouble);
  section.backbone_layers = 3;
  const PolicyNetwork deep(section, 3, 6, at::kDouble);
  const at::NoGradGuard no_grad;
  for (const NamedTensor& parameter : deep.parameters()) {
    at::Tensor value = parameter.value;
    if (parameter.name.starts_with("backbone.") && !parameter.name.starts_with("backbone.0.")) {
      value.zero_();
      continue;
    }
    for (const NamedTensor& other : shallow.parameters()) {
      if (other.name == parameter.name) value.copy_(other.value);
    }
  }
  const Observation seen = observation(Modality::vector, 3);
  const Policy::Output expected = shallow.forward(seen), got = deep.forward(seen);
  EXPECT_TRUE(got.logits.equal(expected.logits));
  EXPECT_TRUE(got.value.equal(expected.value));
}

TEST_P(BothModalities, HasThePapersShapes) {
  PolicySection config;
  config.modality = GetParam();
  config.point_features = false;
  const PolicyNetwork policy(config, 4, 1);
  auto shape_of = [&](const std::string& name) {
    for (const NamedTensor& p : policy.parameters()) {
      if (p.name == name) return p.value.sizes().vec();
    }
    return std::vector<int64_t>{};
  };
  EXPECT_EQ(shape_of("backbone.0.weight"), (std::vector<int64_t>{512, 384}));
  EXPECT_EQ(shape_of("backbone.3.weight"), (std::vector<int64_t>{512, 512}));
  EXPECT_EQ(shape_of("actor.weight"), (std::vector<int64_t>{12, 512}));
  EXPECT_EQ(shape_of("critic.weight"), (std::vector<int64_t>{1, 512}));
  if (GetParam() == Modality::perspective) {
    EXPECT_EQ(shape_of("project.weight"), (std::vector<int64_t>{256, 512}));
    EXPECT_EQ(shape_of("attention.queries"), (std::vector<int64_t>{4, 16, 128}));
    EXPECT_EQ(shape_of("ego.hidden.weight"), (std::vector<int64_t>{64, 7}));
  } else {
    EXPECT_EQ(shape_of("lanes.hidden.weight"), (std::vector<int64_t>{64, 7}));
    EXPECT_EQ(shape_of("ego.hidden.weight"), (std::vector<int64_t>{64, 9}));
  }
}

// Number of inputs of a group's encoder per row.
int64_t inputs_of(const Policy& policy, const std::string& group) {
  for (const NamedTensor& p : policy.parameters()) {
    if (p.name == group + ".hidden.weight") return p.value.size(1);
  }
  return -1;
}

TEST_P(BothModalities, ReadsFeaturesOfPointsInAdditionToCoordinates) {
  PolicySection config;
  config.modality = GetParam();
  const PolicyNetwork policy(config, 4, 1);
  constexpr int kOfPoint = RowFeatures::kOfPoint;
  EXPECT_EQ(inputs_of(policy, "conditioning"), kNumConditioning + kNumWaypoints * (kWaypointFeatures + kOfPoint));
  if (GetParam() == Modality::vector) {
    EXPECT_EQ(inputs_of(policy, "partners"), kPartnerFeatures + kOfPoint);
    EXPECT_EQ(inputs_of(policy, "boundaries"), kBoundaryFeatures + kOfPoint);
    EXPECT_EQ(inputs_of(policy, "controls"), kControlFeatures + 2 * kOfPoint);  // a stop line has two ends
  }
}

TEST(Policy, ReadsItsOffsetFromLanesBoundariesAndWalls) {
  PolicySection config;
  config.modality = Modality::vector;
  config.segment_features = true;
  for (const int of_point : {0, RowFeatures::kOfPoint}) {
    config.point_features = of_point > 0;
    const PolicyNetwork policy(config, 4, 1, at::kFloat, /*reads_walls=*/true);
    EXPECT_EQ(inputs_of(policy, "partners"), kPartnerFeatures + of_point);
    EXPECT_EQ(inputs_of(policy, "lanes"), kLaneFeatures + of_point + RowFeatures::kOfSegment);
    EXPECT_EQ(inputs_of(policy, "boundaries"), kBoundaryFeatures + of_point + RowFeatures::kOfSegment);
    EXPECT_EQ(inputs_of(policy, "walls"), kWallFeatures + of_point + RowFeatures::kOfSegment);
    EXPECT_EQ(inputs_of(policy, "controls"), kControlFeatures + 2 * of_point);
    EXPECT_EQ(inputs_of(policy, "conditioning"), kNumConditioning + kNumWaypoints * (kWaypointFeatures + of_point));
  }
}

// The host's own passes in fp32 against ATen's layers in fp64.
TEST(Policy, FeaturesOfRowsAreTheSameInSingleAndDoublePrecision) {
  PolicySection config = tiny_section(Modality::vector);
  config.segment_features = true;
  const PolicyNetwork doubles(config, 3, 5, at::kDouble, /*reads_walls=*/true), floats(config, 3, 5, at::kFloat, true);
  const Observation seen = observation(Modality::vector, 6);
  const at::NoGradGuard no_grad;
  const at::Tensor expected = doubles.forward(seen).value,
                   got = floats
                             .forward(seen.map(
                                 [](const at::Tensor& t) { return t.is_floating_point() ? t.to(at::kFloat) : t; }))
                             .value;
  EXPECT_GT(expected.std().item<double>(), 1e-2);
  EXPECT_LT((got - expected).abs().max().item<double>(), 1e-5);
}

TEST(Policy, WallsAreAFifthGroupOfTheVectorPolicy) {
  PolicySection config;
  config.point_features = false;
  config.modality = Modality::vector;
  const PolicyNetwork without(config, 4, 1), with(config, 4, 1, at::kFloat, /*reads_walls=*/true);
  auto names_of = [](const Policy& policy) {
    std::vector<std::string> names;
    for (const NamedTensor& p : policy.parameters()) names.push_back(p.name);
    return names;
  };
  auto shape_of = [](const Policy& policy, const std::string& name) {
    for (const NamedTensor& p : policy.parameters()) {
      if (p.name == name) return p.value.sizes().vec();
    }
    return std::vector<int64_t>{};
  };
  EXPECT_EQ(shape_of(with, "backbone.0.weight"), (std::vector<int64_t>{512, 448}));
  EXPECT_EQ(shape_of(with, "walls.hidden.weight"), (std::vector<int64_t>{64, 7}));
  // Checkpoints without walls keep their tensors' names and order.
  const std::vector<std::string> names = names_of(without);
  const std::vector<std::string> groups{"partners.hidden.weight", "lanes.hidden.weight", "boundaries.hidden.weight",
                                        "controls.hidden.weight", "ego.hidden.weight"};
  for (size_t i = 0; i < groups.size(); ++i) EXPECT_EQ(names.at(4 * i), groups[i]);
  EXPECT_EQ(names_of(with).at(16), "walls.hidden.weight");

  const at::NoGradGuard no_grad;
  const Observation o = observation(Modality::vector, 2).map([](const at::Tensor& t) {
    return t.is_floating_point() ? t.to(at::kFloat) : t;
  });
  Observation changed = o.map([](const at::Tensor& t) { return t.clone(); });
  changed.walls.fill_(9);
  EXPECT_TRUE(at::equal(without.forward(o).logits, without.forward(changed).logits));
  EXPECT_FALSE(at::equal(with.forward(o).logits, with.forward(changed).logits));
}

TEST_P(BothModalities, FirstPolicyIsNearlyUniformAndDoesNotDependOnThreads) {
  PolicySection config = tiny_section(GetParam());
  at::set_num_threads(1);
  const PolicyNetwork one(config, 3, 42);
  at::set_num_threads(2);
  const PolicyNetwork two(config, 3, 42), other(config, 3, 43);
  EXPECT_EQ(one.hash(), two.hash());
  EXPECT_NE(one.hash(), other.hash());

  const Observation o = observation(GetParam(), 4);
  const PolicyNetwork doubles(config, 3, 42, at::kDouble);
  const at::NoGradGuard no_grad;
  const at::Tensor probabilities = at::softmax(doubles.forward(o).logits, 1);
  EXPECT_GT(probabilities.min().item<double>(), 0.9 / 12);
  EXPECT_LT(probabilities.max().item<double>(), 1.1 / 12);
}

TEST(Policy, ScaledLogitsAreTheSameTimesAFactor) {
  const PolicyNetwork policy(tiny_section(Modality::vector), 3, 5, at::kDouble);
  const Observation seen = observation(Modality::vector, 2);
  const at::NoGradGuard no_grad;
  const Policy::Output before = policy.forward(seen);
  scale_logits(policy, 3);
  const Policy::Output after = policy.forward(seen);
  EXPECT_TRUE(at::allclose(after.logits, 3 * before.logits));
  EXPECT_TRUE(after.value.equal(before.value));
}

TEST(Policy, AgentsOfABatchAreIndependent) {
  const PolicyNetwork policy(tiny_section(Modality::perspective), 3, 5, at::kDouble);
  const at::NoGradGuard no_grad;
  const Observation o = observation(Modality::perspective, 3);
  const at::Tensor all = policy.forward(o).logits;
  const at::Tensor last = policy.forward(o.map([](const at::Tensor& t) { return t.narrow(0, 2, 1); })).logits;
  EXPECT_LT((all[2] - last[0]).abs().max().item<double>(), 1e-12);
}

TEST(Policy, EveryCameraAffectsTheOutput) {
  const PolicyNetwork policy(tiny_section(Modality::perspective), 3, 5, at::kDouble);
  const at::NoGradGuard no_grad;
  const Observation o = observation(Modality::perspective, 1);
  const at::Tensor before = policy.forward(o).value;
  for (const auto& [block, camera] : {std::pair{0, 0}, std::pair{0, 1}, std::pair{1, 0}}) {
    Observation changed = o.map([](const at::Tensor& t) { return t.clone(); });
    changed.images[block].pixels.select(1, camera).fill_(0);
    EXPECT_GT((policy.forward(changed).value - before).abs().item<double>(), 1e-9) << block << " " << camera;
  }
}

TEST(MaskedMax, IgnoresPaddingAndGivesZeroForEmptySets) {
  const at::Tensor members = at::tensor({-3.0, -1.0, 9.0, /**/ 5.0, 6.0, 7.0}, at::kDouble).reshape({2, 3, 1});
  const at::Tensor largest = masked_max(members, at::tensor({2, 0}, at::kInt));
  EXPECT_EQ(largest[0][0].item<double>(), -1.0);
  EXPECT_EQ(largest[1][0].item<double>(), 0.0);
}

TEST(MaskedMax, PaddingGetsNoGradient) {
  at::Tensor members = at::tensor({-3.0, -1.0, 9.0, /**/ 5.0, 6.0, 7.0}, at::kDouble).reshape({2, 3, 1});
  members.requires_grad_();
  masked_max(members, at::tensor({2, 0}, at::kInt)).sum().backward();
  const at::Tensor expected = at::tensor({0.0, 1.0, 0.0, 0.0, 0.0, 0.0}, at::kDouble).reshape({2, 3, 1});
  EXPECT_TRUE(at::equal(members.grad(), expected));
}

}  // namespace
}  // namespace pictura
