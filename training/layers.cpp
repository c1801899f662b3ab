#include "pictura/training/layers.h"

#include <map>
#include <mutex>
#include <optional>

#include <torch/csrc/autograd/custom_function.h>

#include "pictura/backends/make_learner.h"
#include "pictura/training/torch_device.h"

namespace pictura {

namespace {

using torch::autograd::AutogradContext;
using torch::autograd::Function;
using torch::autograd::variable_list;

bool is_supported(const at::Tensor& x) {
  return x.is_cuda() && (x.scalar_type() == at::kBFloat16 || x.scalar_type() == at::kFloat);
}

ActivationType activation_type_of(at::ScalarType type) {
  return type == at::kBFloat16 ? ActivationType::bf16 : ActivationType::f32;
}

// Of a tensor whose last dimension are the channels.
ActivationSize size_of(const at::Tensor& x) {
  return {activation_type_of(x.scalar_type()), x.numel() / x.size(-1), x.size(-1)};
}

NetworkPasses& passes_on(at::Device device) {
  static std::mutex mutex;
  static std::map<c10::DeviceIndex, std::unique_ptr<NetworkPasses>> of_devices;
  const std::lock_guard lock(mutex);
  std::unique_ptr<NetworkPasses>& passes = of_devices[device.index()];
  if (!passes) passes = make_network_passes({MemorySpace::cuda, device.index()});
  return *passes;
}

Stream stream_on(at::Device device) { return current_stream({MemorySpace::cuda, device.index()}); }

const float* floats_of(const at::Tensor& parameter) { return parameter.const_data_ptr<float>(); }

/// The gradient that arrives, laid out as x is.
at::Tensor arranged(const at::Tensor& grad, const at::Tensor& x) { return grad.to(x.scalar_type()).contiguous(); }

// x: [..., channels] without gaps.
struct BiasGelu : Function<BiasGelu> {
  static at::Tensor forward(AutogradContext* context, const at::Tensor& x, const at::Tensor& bias) {
    context->save_for_backward({x, bias});
    at::Tensor out = at::empty_like(x);
    passes_on(x.device())
        .bias_gelu(size_of(x), x.const_data_ptr(), floats_of(bias), out.mutable_data_ptr(), stream_on(x.device()));
    return out;
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const variable_list saved = context->get_saved_variables();
    const at::Tensor &x = saved[0], &bias = saved[1], grad = arranged(grads[0], x);
    const at::Tensor grad_x = at::empty_like(x),
                     sums = at::empty({NetworkPasses::kBiasSums, bias.size(0)}, bias.options().requires_grad(false));
    passes_on(x.device())
        .bias_gelu_backward(size_of(x), x.const_data_ptr(), floats_of(bias), grad.const_data_ptr(),
                            grad_x.mutable_data_ptr(), sums.mutable_data_ptr<float>(), stream_on(x.device()));
    return {grad_x, sums.sum(0)};
  }
};

// x: [..., channels] without gaps; position: [period, channels] of x's type, or undefined.
struct Norm : Function<Norm> {
  static at::Tensor forward(AutogradContext* context, const at::Tensor& x, const std::optional<at::Tensor>& added,
                            const at::Tensor& weight, const at::Tensor& bias) {
    const at::Tensor position = added.value_or(at::Tensor());
    context->save_for_backward({x, position, weight});
    at::Tensor out = at::empty_like(x);
    passes_on(x.device())
        .norm(size_of(x), x.const_data_ptr(), data_of(position), period_of(position), floats_of(weight),
              floats_of(bias), out.mutable_data_ptr(), stream_on(x.device()));
    return out;
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const variable_list saved = context->get_saved_variables();
    const at::Tensor &x = saved[0], &position = saved[1], &weight = saved[2], grad = arranged(grads[0], x);
    const ActivationSize size = size_of(x);
    const int64_t period = period_of(position);
    const at::Tensor grad_x = at::empty_like(x),
                     sums = at::empty({NetworkPasses::num_norm_sums(size.rows, period), period, 3, size.channels},
                                      weight.options().requires_grad(false));
    passes_on(x.device())
        .norm_backward(size, x.const_data_ptr(), data_of(position), period, floats_of(weight), grad.const_data_ptr(),
                       grad_x.mutable_data_ptr(), sums.mutable_data_ptr<float>(), stream_on(x.device()));
    const at::Tensor by_position = sums.sum(0), all = by_position.sum(0);
    return {grad_x, position.defined() ? by_position.select(1, 0).to(position.scalar_type()) : at::Tensor(), all[1],
            all[2]};
  }

 private:
  static const void* data_of(const at::Tensor& position) {
    return position.defined() ? position.const_data_ptr() : nullptr;
  }
  static int64_t period_of(const at::Tensor& position) { return position.defined() ? position.size(0) : 1; }
};

// scores: [matrices, tokens, columns] without gaps.
struct TokenSoftmax : Function<TokenSoftmax> {
  static at::Tensor forward(AutogradContext* context, const at::Tensor& scores) {
    at::Tensor out = at::empty_like(scores);
    passes_on(scores.device())
        .token_softmax(tokens_of(scores), scores.const_data_ptr(), out.mutable_data_ptr(), stream_on(scores.device()));
    context->save_for_backward({out});
    return out;
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const at::Tensor out = context->get_saved_variables()[0], grad = arranged(grads[0], out);
    at::Tensor grad_scores = at::empty_like(out);
    passes_on(out.device())
        .token_softmax_backward(tokens_of(out), out.const_data_ptr(), grad.const_data_ptr(),
                                grad_scores.mutable_data_ptr(), stream_on(out.device()));
    return {grad_scores};
  }

 private:
  static TokenSize tokens_of(const at::Tensor& scores) {
    return {activation_type_of(scores.scalar_type()), scores.size(0), scores.size(1), scores.size(2)};
  }
};

// [views, cameras, 3, ...] -> [cameras * views, 3, ...]
at::Tensor by_camera(const at::Tensor& images) { return images.transpose(0, 1).flatten(0, 1); }

at::Tensor space_to_depth(const at::Tensor& images, int64_t patch_px) {
  if (patch_px == 1) return images;
  const int64_t channels = images.size(1), height = images.size(2), width = images.size(3);
  const int64_t rows = (height + patch_px - 1) / patch_px, columns = (width + patch_px - 1) / patch_px;
  // [n, c, rows, patch, columns, patch] -> [n, rows, columns, c, patch, patch]: in memory, channels last.
  return at::constant_pad_nd(images, {0, columns * patch_px - width, 0, rows * patch_px - height})
      .view({-1, channels, rows, patch_px, columns, patch_px})
      .permute({0, 2, 4, 1, 3, 5})
      .reshape({-1, rows, columns, channels * patch_px * patch_px})
      .permute({0, 3, 1, 2});
}

}  // namespace

at::Tensor linear_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias) {
  if (!x.is_cuda() || !NetworkPasses::gelu_takes(bias.size(0))) return gelu(at::linear(x, weight, bias));
  return BiasGelu::apply(at::linear(x, weight), bias);
}

at::Tensor convolve_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride) {
  const int64_t padding = weight.size(2) / 2, missing = x.size(1) - weight.size(1);
  const at::Tensor padded = missing > 0 ? at::constant_pad_nd(weight, {0, 0, 0, 0, 0, missing}) : weight;
  if (!x.is_cuda() || !NetworkPasses::gelu_takes(bias.size(0))) {
    return gelu(at::conv2d(x, padded, bias, {stride}, {padding}));
  }
  const at::Tensor rows = at::conv2d(x, padded, {}, {stride}, {padding}).permute({0, 2, 3, 1}).contiguous();
  return BiasGelu::apply(rows, bias).permute({0, 3, 1, 2});
}

at::Tensor norm(const at::Tensor& x, const at::Tensor& position, const at::Tensor& weight, const at::Tensor& bias) {
  if (!is_supported(x) || !NetworkPasses::norm_takes(x.size(-1))) {
    return at::layer_norm(position.defined() ? x + position : x, {x.size(-1)}, weight, bias);
  }
  std::optional<at::Tensor> added;
  if (position.defined()) added = position.to(x.scalar_type()).contiguous();
  return Norm::apply(x.contiguous(), added, weight, bias);
}

at::Tensor token_softmax(const at::Tensor& scores) {
  if (!is_supported(scores) || scores.size(2) % 2 != 0) return at::_softmax(scores, 1, /*half_to_float=*/false);
  return TokenSoftmax::apply(scores.contiguous());
}

namespace {

PointSize point_size(const at::Tensor& rows, int64_t points, float unit_m, bool keeps_rows) {
  const int64_t features = rows.size(-1);
  return {rows.numel() / features, features, points, unit_m, keeps_rows};
}

}  // namespace

bool takes_point_rows(const at::Tensor& rows, int64_t points) {
  return rows.is_cuda() && rows.scalar_type() == at::kFloat &&
         point_size(rows, points, 1, /*keeps_rows=*/true).width() <= PointSize::kMostWidth;
}

at::Tensor point_rows(const at::Tensor& rows, int64_t points, float unit_m, bool keeps_rows, at::ScalarType type) {
  const PointSize size = point_size(rows, points, unit_m, keeps_rows);
  std::vector<int64_t> shape = rows.sizes().vec();
  shape.back() = size.width();
  at::Tensor out = at::empty(shape, rows.options().dtype(type));
  passes_on(rows.device())
      .point_features(size, rows.contiguous().const_data_ptr<float>(), activation_type_of(type), out.mutable_data_ptr(),
                      stream_on(rows.device()));
  return out;
}

at::Tensor image_patches(const at::Tensor& images, int64_t patch_px, at::ScalarType type) {
  if (!images.is_cuda() || !PatchSize::takes(patch_px)) {
    return space_to_depth(by_camera(images), patch_px)
        .to(type, /*non_blocking=*/false, /*copy=*/false, at::MemoryFormat::ChannelsLast);
  }
  const PatchSize size{images.size(0), images.size(1), images.size(3), images.size(4), patch_px};
  const at::Tensor out =
      at::empty({size.cameras * size.views, size.rows(), size.columns(), PatchSize::channels_of(patch_px)},
                images.options().dtype(type));
  passes_on(images.device())
      .patches(size, images.contiguous().const_data_ptr<uint8_t>(), activation_type_of(type), out.mutable_data_ptr(),
               stream_on(images.device()));
  return out.permute({0, 3, 1, 2});
}

}  // namespace pictura
