// Layers on a CUDA device compared with layers in double precision on the host. The errors of values and of all
// gradients are about as small as those of ATen's layers on the device.
#include <gtest/gtest.h>

#include "pictura/policy/layers.h"
#include "pictura/policy/policy.h"
#include "pictura/policy/precision.h"
#include "pictura/policy/row_features.h"
#include "pictura/policy/torch_device.h"
#include "pictura/simulator/rules/ego_frame.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/policy/numbers.h"

namespace pictura {
namespace {

using Layer = std::function<at::Tensor(const std::vector<at::Tensor>& inputs)>;

class DeviceLayers : public test::DeviceTest, public testing::WithParamInterface<Precision> {
 protected:
  static void SetUpTestSuite() {
    Config config;
    config.policy.modality = Modality::vector;
    config.run.device = "cuda";
    open_learning_device(config);
  }

  // Values that bf16 holds exactly, so that rounding inputs changes nothing.
  static at::Tensor numbers(at::IntArrayRef shape, double phase) { return test::numbers(shape, phase, at::kBFloat16); }
  at::ScalarType activations() const { return GetParam() == Precision::bf16 ? at::kBFloat16 : at::kFloat; }

  /// The value and the gradients of all inputs, on the host.
  static std::vector<at::Tensor> results(const Layer& layer, const std::vector<at::Tensor>& inputs) {
    const at::Tensor value = layer(inputs);
    std::vector<at::Tensor> all{value};
    value.backward(numbers(value.sizes(), 0.3).to(value.device(), value.scalar_type()));
    for (const at::Tensor& input : inputs) all.push_back(input.grad());
    for (at::Tensor& result : all) result = result.detach().to(at::kCPU, at::kDouble);
    return all;
  }

  /// Compares a layer with the host. The first `num_activations` inputs are activations, all others parameters. `plain`
  /// is the layer written with ATen, whose errors times `of_atens` are the tolerance.
  void expect_as_on_the_host(const Layer& layer, const Layer& plain, const std::vector<at::Tensor>& inputs,
                             size_t num_activations, double of_atens = 2) {
    set_float32_products(GetParam());
    const auto copies = [&](at::Device device, at::ScalarType of_activations, at::ScalarType of_parameters) {
      std::vector<at::Tensor> result;
      for (size_t i = 0; i < inputs.size(); ++i) {
        const at::ScalarType type = i < num_activations ? of_activations : of_parameters;
        result.push_back(inputs[i].detach().to(device, type, /*non_blocking=*/false, /*copy=*/true).requires_grad_());
      }
      return result;
    };
    const auto on_device = [&](const Layer& some) {
      const LayerPrecision precision(GetParam(), at::kCUDA);
      return results(some, copies(at::kCUDA, activations(), at::kFloat));
    };
    const std::vector<at::Tensor> expected = results(layer, copies(at::kCPU, at::kDouble, at::kDouble)),
                                  got = on_device(layer), atens = on_device(plain);
    const double precision = GetParam() == Precision::bf16   ? 1.0 / 128
                             : GetParam() == Precision::tf32 ? 1.0 / 512
                                                             : 1e-6;
    for (size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(got[i].sizes(), expected[i].sizes());
      const auto error = [&](const at::Tensor& t) { return (t - expected[i]).abs().max().item<double>(); };
      const double largest = expected[i].abs().max().item<double>();
      EXPECT_LE(error(got[i]), of_atens * error(atens[i]) + precision * (0.1 + largest))
          << (i == 0 ? "value" : "gradient " + std::to_string(i - 1)) << ", up to " << largest;
    }
  }
};
INSTANTIATE_TEST_SUITE_P(All, DeviceLayers, ::testing::Values(Precision::fp32, Precision::tf32, Precision::bf16),
                         [](const auto& precision) {
                           return std::string(precision.param == Precision::fp32   ? "fp32"
                                              : precision.param == Precision::tf32 ? "tf32"
                                                                                   : "bf16");
                         });

TEST_P(DeviceLayers, LinearGelu) {
  // 24 and 40: not a power of two of vectors; 6: no vectors at all.
  for (const int64_t out : {512, 64, 40, 24, 6}) {
    for (const int64_t rows : {1, 7, 3000}) {
      expect_as_on_the_host([](const auto& in) { return linear_gelu(in[0], in[1], in[2]); },
                            [](const auto& in) { return gelu(at::linear(in[0], in[1], in[2])); },
                            {numbers({rows, 16}, 1), 0.3 * numbers({out, 16}, 2), numbers({out}, 3)}, 1);
    }
  }
}

TEST_P(DeviceLayers, LinearNormGelu) {
  // 36: ATen's own layer. 9,000 rows exceed the number of partial sums.
  for (const int64_t out : {64, 128, 192, 256, 384, 512, 36}) {
    for (const int64_t rows : {1, 7, 9000}) {
      expect_as_on_the_host([](const auto& in) { return linear_norm_gelu(in[0], in[1], in[2]); },
                            [](const auto& in) {
                              const at::Tensor x = at::linear(in[0], in[1], in[2]);
                              return gelu(at::layer_norm(x, {x.size(-1)})).to(x.scalar_type());
                            },
                            {numbers({rows, 16}, 1), 0.3 * numbers({out, 16}, 2), numbers({out}, 3)}, 1);
    }
  }
}

TEST_P(DeviceLayers, NormalizeKeepsTheTypeOfActivations) {
  for (const int64_t channels : {6, 512, 1024}) {
    expect_as_on_the_host(
        [](const auto& in) {
          const at::Tensor out = normalize(in[0]);
          EXPECT_EQ(out.scalar_type(), in[0].scalar_type());
          return out;
        },
        [](const auto& in) { return at::layer_norm(in[0], {in[0].size(-1)}).to(in[0].scalar_type()); },
        {numbers({300, channels}, 1)}, 1);
  }
}

TEST_P(DeviceLayers, ConvolveGelu) {
  for (const bool has_norm : {false, true}) {
    for (const int64_t stride : {1, 2}) {
      const auto layer = [&](const auto& in) {
        const at::Tensor x = in[0].contiguous(at::MemoryFormat::ChannelsLast);
        return (has_norm ? convolve_norm_gelu : convolve_gelu)(x, in[1], in[2], stride);
      };
      const auto plain = [&](const auto& in) {
        at::Tensor x = at::conv2d(in[0].narrow(1, 0, 12), in[1], in[2], {stride}, {1}).permute({0, 2, 3, 1});
        if (has_norm) x = at::layer_norm(x, {x.size(-1)}).to(x.scalar_type());
        return gelu(x).permute({0, 3, 1, 2});
      };
      // 64: fused with the norm; 32: ATen's own norm. Images of 9x12 would not do: with 64 outputs, the terms of the
      // weight's gradient cancel to a hundredth there.
      for (const int64_t out : {32, 64}) {
        expect_as_on_the_host(layer, plain,
                              {numbers({5, 16, 7, 10}, 1), 0.1 * numbers({out, 12, 3, 3}, 2), numbers({out}, 3)}, 1);
      }
    }
  }
}

TEST_P(DeviceLayers, Norm) {
  const Layer with_position = [](const auto& in) { return norm(in[0], in[1], in[2], in[3]).to(in[0].scalar_type()); };
  const Layer plain_with_position = [](const auto& in) {
    return at::layer_norm(in[0] + in[1], {in[0].size(-1)}, in[2], in[3]).to(in[0].scalar_type());
  };
  const Layer without = [](const auto& in) { return norm(in[0], {}, in[1], in[2]).to(in[0].scalar_type()); };
  const Layer plain_without = [](const auto& in) {
    return at::layer_norm(in[0], {in[0].size(-1)}, in[1], in[2]).to(in[0].scalar_type());
  };
  // 36: ATen's own layer.
  for (const int64_t channels : {64, 128, 192, 256, 384, 512, 36}) {
    const at::Tensor weight = numbers({channels}, 2), bias = numbers({channels}, 3);
    for (const int64_t repetitions : {1, 300}) {
      expect_as_on_the_host(with_position, plain_with_position,
                            {numbers({repetitions, 7, channels}, 1), numbers({7, channels}, 4), weight, bias}, 2);
    }
    expect_as_on_the_host(without, plain_without, {numbers({2, 50, channels}, 1), weight, bias}, 1);
  }
}

// Whether the largest of the present members, [sets, most, width], leads by more than a margin, [sets, width].
at::Tensor has_clear_largest(const at::Tensor& members, const at::Tensor& counts, double margin) {
  const at::Tensor is_padding = at::arange(members.size(1), counts.options()).unsqueeze(0) >= counts.unsqueeze(1);
  const at::Tensor padded =
      at::constant_pad_nd(members.masked_fill(is_padding.unsqueeze(2), -std::numeric_limits<double>::infinity()),
                          {0, 0, 0, 1}, -std::numeric_limits<double>::infinity());
  const at::Tensor two = std::get<0>(padded.topk(2, 1));
  return two.select(1, 0) > two.select(1, 1) + margin;
}

TEST_P(DeviceLayers, LargestEmbedding) {
  const int64_t sets = 300;
  const RowFeatures of_point{.points = 1, .position_unit_m = kScalePosition_m},
      of_segment{.points = 1, .of_segment = true, .position_unit_m = kScalePosition_m};
  for (const auto& [channels, features] :
       {std::pair{64, RowFeatures{}}, {64, of_point}, {64, of_segment}, {128, of_segment}}) {
    for (const int64_t max_members : {1, 10, 80}) {
      for (const bool has_norm : {false, true}) {
        const at::Tensor members = numbers({sets, max_members, 7}, 1).to(at::kFloat),
                         // Empty and full sets; entries beyond a column of counts are not read.
            counts = at::arange(sets, at::kInt).remainder(max_members + 1).unsqueeze(1).repeat({1, 2}).select(1, 0);
        const int64_t width = 7 + features.count();
        const std::vector<at::Tensor> parameters{numbers({channels, width}, 1), numbers({channels}, 2),
                                                 0.3 * numbers({channels, channels}, 3), numbers({channels}, 4)};
        const auto on = [](const at::Tensor& t, const at::Tensor& where) { return t.to(where.device()); };
        // Doubles rounded to the device's type, with the gradient of the unrounded values.
        const auto rounded = [&](const at::Tensor& x) { return x.detach().to(activations()).to(at::kDouble); };
        const auto as_held = [&](const at::Tensor& x) {
          return x.scalar_type() == at::kDouble ? x + (rounded(x) - x.detach()) : x;
        };
        const Layer embeddings = [&](const auto& in) {
          const bool is_double = in[0].scalar_type() == at::kDouble;
          const at::ScalarType type = is_double ? at::kDouble : activations();
          const at::Tensor its_members = on(members, in[0]);
          const at::Tensor rows =
              features.count() > 0
                  ? with_row_features(its_members.to(is_double ? at::kDouble : at::kFloat), features, type)
                  : its_members.to(type);
          const at::Tensor before = at::linear(as_held(rows), in[0]) + in[1];
          // The layer's gradient is rounded too.
          if (is_double && before.requires_grad()) before.register_hook(rounded);
          const at::Tensor hidden =
              gelu(has_norm ? at::layer_norm(before, {channels}).to(before.scalar_type()) : before);
          return at::linear(as_held(hidden), as_held(in[2]), in[3]);
        };
        // Among members that are nearly equal, rounding decides which one the gradient reaches; their gradient is set
        // to 0.
        const at::Tensor is_clear = has_clear_largest(embeddings(parameters), counts, /*margin=*/0.02);
        EXPECT_GT(is_clear.to(at::kDouble).mean().item<double>(), 0.2);
        const auto with_clear_gradient = [&](at::Tensor largest) {
          if (largest.requires_grad()) {
            largest.register_hook([&](const at::Tensor& gradient) { return gradient * on(is_clear, gradient); });
          }
          return largest;
        };
        const Layer plain = [&](const auto& in) {
          return with_clear_gradient(masked_max(embeddings(in), on(counts, in[0])));
        };
        const Layer layer = [&](const auto& in) {
          if (!in[0].is_cuda()) return plain(in);
          const at::Tensor its_members = on(members, in[0]), its_counts = on(counts, in[0]);
          EXPECT_EQ(has_fused_set_encoder(its_members, features, in[0], in[2]), GetParam() == Precision::bf16);
          if (GetParam() != Precision::bf16) return plain(in);
          return with_clear_gradient(
              largest_embedding(its_members, its_counts, features, has_norm, in[0], in[1], in[2], in[3]));
        };
        // ATen also rounds the embeddings, and so selects other members.
        expect_as_on_the_host(layer, plain, parameters, 0, GetParam() == Precision::bf16 ? 0 : 2);
        if (GetParam() != Precision::bf16) continue;
        // Without a backward pass the bits are the same.
        const LayerPrecision precision(Precision::bf16, at::kCUDA);
        std::vector<at::Tensor> on_device;
        for (const at::Tensor& p : parameters) on_device.push_back(p.to(at::kCUDA, at::kFloat));
        const at::Tensor value = layer(on_device);
        for (at::Tensor& p : on_device) p.requires_grad_();
        EXPECT_TRUE(layer(on_device).equal(value));
      }
    }
  }
}

TEST_P(DeviceLayers, LargestEmbeddingPropagatesNanOfMembers) {
  if (GetParam() != Precision::bf16) GTEST_SKIP() << "one pass in bf16 alone";
  const LayerPrecision precision(Precision::bf16, at::kCUDA);
  const auto options = at::TensorOptions(at::kCUDA).dtype(at::kFloat);
  at::Tensor members = at::zeros({1, 40, 2}, options);
  members[0][20][0] = std::numeric_limits<float>::quiet_NaN();
  const auto largest = [&](int count) {
    return largest_embedding(members, at::full({1}, count, options.dtype(at::kInt)), {}, /*has_norm=*/false,
                             at::ones({64, 2}, options), at::zeros({64}, options), at::ones({64, 64}, options),
                             at::zeros({64}, options))
        .to(at::kCPU, at::kFloat);
  };
  EXPECT_TRUE(largest(40).isnan().all().item<bool>());
  EXPECT_TRUE(largest(20).eq(0).all().item<bool>());
}

TEST_P(DeviceLayers, TokenSoftmax) {
  // 5: ATen's own layer.
  for (const int64_t columns : {2, 64, 5}) {
    expect_as_on_the_host([](const auto& in) { return token_softmax(in[0]); },
                          [](const auto& in) { return at::_softmax(in[0], 1, /*half_to_float=*/false); },
                          {8 * numbers({30, 84, columns}, 1)}, 1);
  }
}

TEST_P(DeviceLayers, RowFeatures) {
  struct Case {
    int64_t columns;
    int points;
    bool of_segment;
  };
  for (const Case& c : {Case{7, 1, false}, Case{4, 2, false}, Case{2, 1, false}, Case{40, 20, false}, Case{7, 0, true},
                        Case{7, 1, true}}) {
    const RowFeatures features{.points = c.points, .of_segment = c.of_segment, .position_unit_m = kScalePosition_m};
    const at::Tensor rows = numbers({31, 17, c.columns}, 1).to(at::kFloat), on_device = rows.to(at::kCUDA);
    const at::Tensor expected = with_row_features(rows.to(at::kDouble), features, at::kDouble);
    ASSERT_TRUE(has_fused_row_features(on_device, features));
    const at::Tensor got = with_row_features(on_device, features, activations());
    ASSERT_EQ(got.sizes(), expected.sizes());
    EXPECT_EQ(got.scalar_type(), activations());
    EXPECT_TRUE(got.narrow(-1, 0, c.columns).to(at::kCPU, at::kFloat).equal(rows)) << "bf16 holds these";
    const double error = (got.to(at::kCPU, at::kDouble) - expected).abs().max().item<double>();
    EXPECT_LE(error, activations() == at::kBFloat16 ? 1.0 / 500 : 1e-5) << c.columns << " " << c.points;
    EXPECT_TRUE(got.narrow(-1, c.columns, features.count()).equal(row_features(on_device, features, activations())));
  }
}

TEST_P(DeviceLayers, ImagePatchesEqualTheHostsWithZeroChannels) {
  for (const int64_t width : {12, 13}) {  // whole patches in most sizes, and black pixels that complete them
    const at::Tensor images =
        at::arange(3 * 2 * 3 * 10 * width, at::kInt).remainder(251).to(at::kByte).reshape({3, 2, 3, 10, width});
    for (const int64_t patch_px : {1, 2, 3, 4, 6, 8, 12}) {
      SCOPED_TRACE(fmt::format("width {}, patches of {} px", width, patch_px));
      const at::Tensor expected = image_patches(images, patch_px, activations());
      const at::Tensor got = image_patches(images.to(at::kCUDA), patch_px, activations()).to(at::kCPU);
      EXPECT_TRUE(got.narrow(1, 0, expected.size(1)).equal(expected));
      EXPECT_EQ(got.size(1) % 8, 0);
      EXPECT_EQ(got.slice(1, expected.size(1)).abs().sum().item<float>(), 0);
      EXPECT_TRUE(got.is_contiguous(at::MemoryFormat::ChannelsLast));
    }
  }
}

}  // namespace
}  // namespace pictura
