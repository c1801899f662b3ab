#include "pictura/policy/layers.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>

#include <ATen/Parallel.h>
#include <ATen/autocast_mode.h>
#include <ATen/core/LegacyTypeDispatch.h>
#include <ATen/core/grad_mode.h>
#include <torch/csrc/autograd/custom_function.h>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/policy/host_passes.h"
#include "pictura/policy/torch_device.h"

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

// Returns the size of a tensor whose last dimension is the channels.
ActivationSize size_of(const at::Tensor& x) {
  return {activation_type_of(x.scalar_type()), x.numel() / x.size(-1), x.size(-1)};
}

/// Creates the NetworkPasses of a device. They have no state. Each call creates its own object, so that threads of
/// autograd share none.
std::unique_ptr<NetworkPasses> passes_on(at::Device device) {
  return make_network_passes({MemorySpace::cuda, device.index()});
}

Stream stream_on(at::Device device) { return current_stream({MemorySpace::cuda, device.index()}); }

const float* floats_of(const at::Tensor& parameter) { return parameter.const_data_ptr<float>(); }

/// Returns the incoming gradient in the type of x, contiguous.
at::Tensor arranged(const at::Tensor& grad, const at::Tensor& x) { return grad.to(x.scalar_type()).contiguous(); }

// GELU of x + bias on a device. x: [..., channels], contiguous. With kHasNorm x + bias is normalized before the GELU.
template <bool kHasNorm>
struct BiasGelu : Function<BiasGelu<kHasNorm>> {
  static at::Tensor forward(AutogradContext* context, const at::Tensor& x, const at::Tensor& bias) {
    context->save_for_backward({x, bias});
    at::Tensor out = at::empty_like(x);
    constexpr auto kPass = kHasNorm ? &NetworkPasses::bias_norm_gelu : &NetworkPasses::bias_gelu;
    ((*passes_on(x.device())).*kPass)(size_of(x), x.const_data_ptr(), floats_of(bias), out.mutable_data_ptr(),
                                      stream_on(x.device()));
    return out;
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const variable_list saved = context->get_saved_variables();
    const at::Tensor &x = saved[0], &bias = saved[1], grad = arranged(grads[0], x);
    const ActivationSize size = size_of(x);
    const int64_t num_sums = kHasNorm ? NetworkPasses::num_norm_sums(size.rows, 1) : NetworkPasses::kBiasSums;
    const at::Tensor grad_x = at::empty_like(x),
                     sums = at::empty({num_sums, size.channels}, bias.options().requires_grad(false));
    constexpr auto kPass = kHasNorm ? &NetworkPasses::bias_norm_gelu_backward : &NetworkPasses::bias_gelu_backward;
    ((*passes_on(x.device())).*kPass)(size, x.const_data_ptr(), floats_of(bias), grad.const_data_ptr(),
                                      grad_x.mutable_data_ptr(), sums.mutable_data_ptr<float>(), stream_on(x.device()));
    return {grad_x, sums.sum(0)};
  }
};

// Layer norm on a device. x: [..., channels], contiguous; position: [period, channels] with the type of x, or
// undefined.
struct Norm : Function<Norm> {
  static at::Tensor forward(AutogradContext* context, const at::Tensor& x, const std::optional<at::Tensor>& added,
                            const at::Tensor& weight, const at::Tensor& bias) {
    const at::Tensor position = added.value_or(at::Tensor());
    context->save_for_backward({x, position, weight});
    at::Tensor out = at::empty_like(x);
    passes_on(x.device())
        ->norm(size_of(x), x.const_data_ptr(), data_of(position), period_of(position), floats_of(weight),
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
        ->norm_backward(size, x.const_data_ptr(), data_of(position), period, floats_of(weight), grad.const_data_ptr(),
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

// Softmax over tokens on a device. scores: [matrices, tokens, columns], contiguous.
struct TokenSoftmax : Function<TokenSoftmax> {
  static at::Tensor forward(AutogradContext* context, const at::Tensor& scores) {
    at::Tensor out = at::empty_like(scores);
    passes_on(scores.device())
        ->token_softmax(tokens_of(scores), scores.const_data_ptr(), out.mutable_data_ptr(), stream_on(scores.device()));
    context->save_for_backward({out});
    return out;
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const at::Tensor out = context->get_saved_variables()[0], grad = arranged(grads[0], out);
    at::Tensor grad_scores = at::empty_like(out);
    passes_on(out.device())
        ->token_softmax_backward(tokens_of(out), out.const_data_ptr(), grad.const_data_ptr(),
                                 grad_scores.mutable_data_ptr(), stream_on(out.device()));
    return {grad_scores};
  }

 private:
  static TokenSize tokens_of(const at::Tensor& scores) {
    return {activation_type_of(scores.scalar_type()), scores.size(0), scores.size(1), scores.size(2)};
  }
};

RowSize row_size(const at::Tensor& rows, const RowFeatures& features, bool keeps_rows) {
  return {rows.numel() / rows.size(-1), rows.size(-1), features, keeps_rows};
}

// Whether the host's passes (host_passes.h) support x. These passes compute in fp32, so they do not support layers in
// bf16.
bool is_on_host(const at::Tensor& x) {
  return x.is_cpu() && x.scalar_type() == at::kFloat && !at::autocast::is_autocast_enabled(at::kCPU);
}

// Whether the results of these inputs need gradients.
bool keeps_gradients(std::initializer_list<at::Tensor> inputs) {
  return at::GradMode::is_enabled() &&
         std::any_of(inputs.begin(), inputs.end(), [](const at::Tensor& t) { return t.requires_grad(); });
}

// Divides [0, count) into one part per thread of torch, and each part into blocks of at most `block` elements. Callers
// add the sums of parts in the order of parts, so results depend on the number of threads, but not on timing.
class Blocks {
 public:
  Blocks(int64_t count, int64_t block)
      : count_(count),
        block_(std::max<int64_t>(1, block)),
        blocks_((count + block_ - 1) / block_),
        parts_(std::min<int64_t>(blocks_, at::get_num_threads())) {}

  int64_t parts() const { return parts_; }
  /// Size of the largest block.
  int64_t max_size() const { return std::min(block_, count_); }

  /// Calls make(part) once per part. The function that make() returns is then called with (begin, end) of each block of
  /// the part.
  template <typename Make>
  void run(const Make& make) const {
    at::parallel_for(0, parts_, 1, [&](int64_t first, int64_t last) {
      const at::AutoDispatchBelowAutograd no_autograd;
      for (int64_t part = first; part < last; ++part) {
        auto work = make(part);
        for (int64_t i = part * blocks_ / parts_; i < (part + 1) * blocks_ / parts_; ++i) {
          work(i * block_, std::min(count_, (i + 1) * block_));
        }
      }
    });
  }

 private:
  int64_t count_, block_, blocks_, parts_;
};

const float* read(const at::Tensor& t, int64_t row = 0) { return t.const_data_ptr<float>() + row * t.stride(0); }
float* write(const at::Tensor& t, int64_t row = 0) { return t.mutable_data_ptr<float>() + row * t.stride(0); }

// Computes `out`, and `slope` if it is defined, with host::bias_gelu(). All tensors are [..., channels] and contiguous.
void add_bias_gelu(const at::Tensor& x, const at::Tensor& bias, const at::Tensor& out, const at::Tensor& slope) {
  const int64_t channels = bias.size(0), rows = x.numel() / channels;
  const float* const from = read(x);
  float *const to = write(out), *const its_slope = slope.defined() ? write(slope) : nullptr;
  Blocks(rows, host::kBlockNumbers / channels).run([&](int64_t) {
    return [&](int64_t begin, int64_t end) {
      const int64_t first = begin * channels;
      host::bias_gelu(from + first, read(bias), end - begin, channels, to + first,
                      its_slope ? its_slope + first : nullptr);
    };
  });
}

// GELU of x + bias. x: [..., channels], contiguous. The memory of x is overwritten with the derivative, so no other
// code may read x.
struct HostBiasGelu : Function<HostBiasGelu> {
  static at::Tensor forward(AutogradContext* context, const at::Tensor& x, const at::Tensor& bias) {
    at::Tensor out = at::empty_like(x), slope = x.detach();
    add_bias_gelu(x, bias, out, slope);
    context->save_for_backward({slope});
    return out;
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const at::Tensor slope = context->get_saved_variables()[0], grad = grads[0].contiguous();
    const int64_t channels = slope.size(-1);
    at::Tensor grad_x = at::empty_like(slope);
    const Blocks blocks(slope.numel() / channels, host::kBlockNumbers / channels);
    const at::Tensor sums = at::zeros({blocks.parts(), channels}, slope.options());
    blocks.run([&](int64_t part) {
      return [&, part](int64_t begin, int64_t end) {
        const int64_t first = begin * channels;
        host::bias_gelu_backward(read(slope) + first, read(grad) + first, end - begin, channels, write(grad_x) + first,
                                 write(sums, part));
      };
    });
    return {grad_x, sums.sum(0)};
  }
};

at::Tensor host_bias_gelu(const at::Tensor& x, const at::Tensor& bias) {
  if (keeps_gradients({x, bias})) return HostBiasGelu::apply(x, bias);
  add_bias_gelu(x, bias, x, {});
  return x;
}

host::ConvolutionSize convolution_size(const at::Tensor& x, const at::Tensor& weight, int64_t stride) {
  return {x.size(1), x.size(2), x.size(3), weight.size(2), stride};
}

// Computes a convolution with GELU by Pass::compute(), and saves the tensors that the backward pass needs: images,
// weight, and the derivatives of the GELUs.
template <typename Pass>
at::Tensor forward_with_slopes(AutogradContext* context, const at::Tensor& x, const at::Tensor& weight,
                               const at::Tensor& bias, int64_t stride) {
  at::Tensor slope;
  const at::Tensor out = Pass::compute(x, weight, bias, stride, &slope);
  context->save_for_backward({x, weight, slope});
  context->saved_data["stride"] = stride;
  return out;
}

// Convolution with few output channels by host::DirectConvolution, one block of images at a time. Shapes as in
// HostConvolution.
struct HostDirectConvolution : Function<HostDirectConvolution> {
  static bool supports(const at::Tensor& x, const at::Tensor& weight) {
    return host::DirectConvolution::supports(weight.size(0)) &&
           (host::DirectConvolution::supports_gradient(x.size(3)) || !keeps_gradients({x}));
  }

  static at::Tensor compute(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride,
                            at::Tensor* slope_out) {
    const host::ConvolutionSize size = convolution_size(x, weight, stride);
    const int64_t outputs = weight.size(0);
    const at::Tensor by_tap = weight.detach().permute({2, 3, 1, 0}).contiguous(),
                     out = at::empty({x.size(0), size.rows(), size.columns(), outputs}, by_tap.options()),
                     sums = slope_out ? at::empty_like(out) : out;
    const Blocks blocks = blocks_of(x.size(0), size, outputs);
    blocks.run([&](int64_t) {
      return [&, convolution = host::DirectConvolution(size, outputs, blocks.max_size())](int64_t begin,
                                                                                          int64_t end) mutable {
        convolution.read(read(x, begin), end - begin);
        convolution.compute(read(by_tap), write(sums, begin));
        host::bias_gelu(read(sums, begin), read(bias), (end - begin) * size.pixels(), outputs, write(out, begin),
                        slope_out ? write(sums, begin) : nullptr);
      };
    });
    if (slope_out) *slope_out = sums;
    return out;
  }

  static at::Tensor forward(AutogradContext* context, const at::Tensor& x, const at::Tensor& weight,
                            const at::Tensor& bias, int64_t stride) {
    return forward_with_slopes<HostDirectConvolution>(context, x, weight, bias, stride);
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const variable_list saved = context->get_saved_variables();
    const at::Tensor x = saved[0].detach(), weight = saved[1].detach().permute({0, 2, 3, 1}).contiguous(),
                     &slope = saved[2], grad = grads[0].contiguous();
    const host::ConvolutionSize size = convolution_size(x, saved[1], context->saved_data["stride"].toInt());
    const int64_t outputs = weight.size(0);
    const Blocks blocks = blocks_of(x.size(0), size, outputs);
    const at::Tensor weight_sums = at::zeros({blocks.parts(), size.taps(), outputs}, weight.options()),
                     bias_sums = at::zeros({blocks.parts(), outputs}, weight.options()),
                     grad_x = context->needs_input_grad(0) ? at::empty_like(x) : at::Tensor();
    blocks.run([&](int64_t part) {
      return [&, part, convolution = host::DirectConvolution(size, outputs, blocks.max_size()),
              sums_grad = at::empty({blocks.max_size() * size.pixels(), outputs}, weight.options())](
                 int64_t begin, int64_t end) mutable {
        host::bias_gelu_backward(read(slope, begin), read(grad, begin), (end - begin) * size.pixels(), outputs,
                                 write(sums_grad), write(bias_sums, part));
        convolution.read(read(x, begin), end - begin);
        convolution.add_weight_gradient(read(sums_grad), write(weight_sums, part));
        if (!grad_x.defined()) return;
        convolution.compute_image_gradient(read(sums_grad), read(weight), write(grad_x, begin));
      };
    });
    const at::Tensor weight_grad =
        weight_sums.sum(0).view({size.kernel, size.kernel, size.channels, outputs}).permute({3, 2, 0, 1});
    return {grad_x, weight_grad, bias_sums.sum(0), at::Tensor()};
  }

 private:
  static Blocks blocks_of(int64_t images, const host::ConvolutionSize& size, int64_t outputs) {
    return {images, host::kBlockNumbers / (size.padded_numbers() + size.pixels() * outputs)};
  }
};

// Convolution as matrix products of taps (the inputs of each output) and weights, one block of images at a time. For
// few channels, its backward pass is two to four times as fast as that of oneDNN.
struct HostConvolution : Function<HostConvolution> {
  /// Minimum number of output channels; with fewer, matrix products do not fill a vector unit.
  static constexpr int64_t kMinOutputs = 16;

  HostConvolution(const at::Tensor& x, const at::Tensor& w, int64_t stride)
      : size(convolution_size(x, w, stride)),
        outputs(w.size(0)),
        blocks(x.size(0), host::kBlockNumbers / (size.pixels() * (size.taps() + outputs))),
        weight(w.detach().permute({0, 2, 3, 1}).reshape({outputs, size.taps()})) {}

  const host::ConvolutionSize size;
  const int64_t outputs;
  const Blocks blocks;
  const at::Tensor weight;  // [outputs, taps]

  bool reads_pixels() const { return size.kernel == 1 && size.stride == 1; }
  at::Tensor scratch(int64_t columns) const {
    return at::empty({blocks.max_size() * size.pixels(), columns}, weight.options());
  }
  at::Tensor of_images(const at::Tensor& rows, int64_t begin, int64_t end) const {
    return rows.narrow(0, begin * size.pixels(), (end - begin) * size.pixels());
  }
  /// Returns the taps of the outputs of images [begin, end). If the taps are the pixels themselves, these are returned,
  /// else `memory` is filled.
  at::Tensor taps(const at::Tensor& x, const at::Tensor& memory, int64_t begin, int64_t end) const {
    if (reads_pixels()) return of_images(x.view({-1, size.channels}), begin, end);
    host::unfold(size, read(x, begin), end - begin, write(memory));
    return memory.narrow(0, 0, (end - begin) * size.pixels());
  }

  /// Returns the outputs, [n, rows, columns, outputs]. x: [n, height, width, channels]. If `slope_out` is not null, it
  /// gets the derivatives of the GELUs, with the shape of the outputs.
  static at::Tensor compute(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride,
                            at::Tensor* slope_out) {
    const HostConvolution c(x, weight, stride);
    const at::Tensor out = at::empty({x.size(0), c.size.rows(), c.size.columns(), c.outputs}, c.weight.options()),
                     products = slope_out ? at::empty_like(out) : out;
    const at::Tensor rows = out.view({-1, c.outputs}), product_rows = products.view({-1, c.outputs}),
                     transposed = c.weight.t();
    c.blocks.run([&](int64_t) {
      return [&, memory = c.reads_pixels() ? at::Tensor() : c.scratch(c.size.taps())](int64_t begin, int64_t end) {
        at::Tensor some = c.of_images(product_rows, begin, end);
        at::mm_out(some, c.taps(x, memory, begin, end), transposed);
        host::bias_gelu(read(some), read(bias), some.size(0), c.outputs, write(c.of_images(rows, begin, end)),
                        slope_out ? write(some) : nullptr);
      };
    });
    if (slope_out) *slope_out = products;
    return out;
  }

  static at::Tensor forward(AutogradContext* context, const at::Tensor& x, const at::Tensor& weight,
                            const at::Tensor& bias, int64_t stride) {
    return forward_with_slopes<HostConvolution>(context, x, weight, bias, stride);
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const variable_list saved = context->get_saved_variables();
    const at::Tensor x = saved[0].detach(), &slope = saved[2], grad = grads[0].contiguous();
    const HostConvolution c(x, saved[1], context->saved_data["stride"].toInt());
    const at::Tensor slope_rows = slope.view({-1, c.outputs}), grad_rows = grad.view({-1, c.outputs});
    const at::Tensor weight_sums = at::zeros({c.blocks.parts(), c.outputs, c.size.taps()}, c.weight.options()),
                     bias_sums = at::zeros({c.blocks.parts(), c.outputs}, c.weight.options());
    const at::Tensor grad_x = context->needs_input_grad(0) ? at::empty_like(x) : at::Tensor();
    c.blocks.run([&](int64_t part) {
      return [&, part, memory = c.scratch(c.size.taps()), product_grads = c.scratch(c.outputs),
              weight_sum = weight_sums[part]](int64_t begin, int64_t end) {
        const at::Tensor some = c.of_images(slope_rows, begin, end),
                         grad_some = product_grads.narrow(0, 0, some.size(0));
        host::bias_gelu_backward(read(some), read(c.of_images(grad_rows, begin, end)), some.size(0), c.outputs,
                                 write(grad_some), write(bias_sums, part));
        at::Tensor sum = weight_sum;
        at::addmm_out(sum, sum, grad_some.t(), c.taps(x, memory, begin, end));
        if (!grad_x.defined()) return;
        at::Tensor taps_grad = c.reads_pixels() ? c.of_images(grad_x.view({-1, c.size.channels}), begin, end)
                                                : memory.narrow(0, 0, some.size(0));
        at::mm_out(taps_grad, grad_some, c.weight);
        if (!c.reads_pixels()) host::fold(c.size, read(taps_grad), end - begin, write(grad_x, begin));
      };
    });
    const at::Tensor weight_grad =
        weight_sums.sum(0).view({c.outputs, c.size.kernel, c.size.kernel, c.size.channels}).permute({0, 3, 1, 2});
    return {grad_x, weight_grad, bias_sums.sum(0), at::Tensor()};
  }
};

// Implementation of largest_embedding() on the host, in blocks of sets. The gradient of a channel goes only to the
// member with the largest value, so the backward pass reads only a few members per set.
struct HostSets : Function<HostSets> {
  /// Returns three tensors: the largest embeddings, [sets, channels]; the members of all sets with their features,
  /// [all, width]; the index of the largest member in its set, i32 [sets, channels].
  static variable_list compute(const at::Tensor& members, const at::Tensor& counts, const RowFeatures& features,
                               bool has_norm, const at::Tensor& hidden_weight, const at::Tensor& hidden_bias,
                               const at::Tensor& weight, const at::Tensor& bias) {
    const int64_t sets = members.size(0), max_members = members.size(1), hidden = hidden_weight.size(0),
                  channels = weight.size(0);
    const RowSize size = row_size(members, features, /*keeps_rows=*/true);
    const std::vector<int64_t> begins = begins_of(counts);
    const auto options = members.options().requires_grad(false);
    const at::Tensor rows = at::empty({begins.back(), size.width()}, options),
                     largest = at::empty({sets, channels}, options),
                     which = at::empty({sets, channels}, counts.options());
    const Blocks blocks(sets, host::kBlockNumbers / (max_members * (hidden + channels)));
    const at::Tensor hidden_transposed = hidden_weight.detach().t(), transposed = weight.detach().t(),
                     gelu_bias = gelu_bias_of(hidden_bias.detach(), has_norm);
    blocks.run([&](int64_t) {
      return [&, hidden_memory = at::empty({blocks.max_size() * max_members, hidden}, options),
              memory = at::empty({blocks.max_size() * max_members, channels}, options)](int64_t begin, int64_t end) {
        const auto first = begins[begin], count = begins[end] - first;
        const int32_t* const its_counts = counts.const_data_ptr<int32_t>() + begin;
        const at::Tensor some = rows.narrow(0, first, count);
        host::member_rows(read(members, begin), its_counts, end - begin, max_members, size, write(some));
        at::Tensor activations = hidden_memory.narrow(0, 0, count), embeddings = memory.narrow(0, 0, count);
        at::mm_out(activations, some, hidden_transposed);
        if (has_norm) host::bias_norm(read(activations), read(hidden_bias), count, hidden, write(activations), nullptr);
        host::bias_gelu(read(activations), read(gelu_bias), count, hidden, write(activations), nullptr);
        at::mm_out(embeddings, activations, transposed);
        host::largest_members(read(embeddings), its_counts, end - begin, channels, write(largest, begin),
                              which.mutable_data_ptr<int32_t>() + begin * channels);
      };
    });
    // The bias is added last, because it does not change which member is the largest.
    return {largest + bias.detach() * counts.gt(0).unsqueeze(1), rows, which};
  }

  static at::Tensor forward(AutogradContext* context, const at::Tensor& members, const at::Tensor& counts,
                            const RowFeatures& features, bool has_norm, const at::Tensor& hidden_weight,
                            const at::Tensor& hidden_bias, const at::Tensor& weight, const at::Tensor& bias) {
    const variable_list made = compute(members, counts, features, has_norm, hidden_weight, hidden_bias, weight, bias);
    context->save_for_backward({made[1], made[2], counts, hidden_weight, hidden_bias, weight});
    context->saved_data["has_norm"] = has_norm;
    return made[0];
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const variable_list saved = context->get_saved_variables();
    const at::Tensor &rows = saved[0], &which = saved[1], &counts = saved[2], hidden_weight = saved[3].detach(),
                     hidden_bias = saved[4].detach(), weight = saved[5].detach().contiguous(),
                     grad = grads[0].contiguous();
    const int64_t sets = which.size(0), channels = which.size(1), hidden = hidden_weight.size(0);
    const bool has_norm = context->saved_data["has_norm"].toBool();
    const std::vector<int64_t> begins = begins_of(counts);
    // Most members are the largest in no channel, so slopes, activations and their gradients have few rows.
    const Blocks blocks(sets, host::kBlockNumbers / (16 * hidden));
    const auto options = weight.options();
    const at::Tensor hidden_weight_sums = at::zeros({blocks.parts(), hidden, rows.size(1)}, options),
                     hidden_bias_sums = at::zeros({blocks.parts(), hidden}, options),
                     gelu_bias_sums = at::zeros({blocks.parts(), hidden}, options),  // ignored if there is a norm
        weight_sums = at::zeros({blocks.parts(), channels, hidden}, options);
    const at::Tensor hidden_transposed = hidden_weight.t(), gelu_bias = gelu_bias_of(hidden_bias, has_norm);
    blocks.run([&](int64_t part) {
      return [&, part, numbers = std::vector<int32_t>(), places = std::vector<int32_t>(),
              chosen = std::vector<int64_t>(),
              hidden_weight_sum = hidden_weight_sums[part]](int64_t begin, int64_t end) mutable {
        // Collect the members that are the largest in at least one channel, and for each channel the index of its
        // largest member among these.
        chosen.clear();
        places.clear();
        const int32_t* its_which = which.const_data_ptr<int32_t>() + begin * channels;
        for (int64_t set = begin; set < end; ++set, its_which += channels) {
          const int64_t first = begins[set], count = begins[static_cast<size_t>(set) + 1] - first;
          numbers.assign(count, -1);
          for (int64_t c = 0; c < channels; ++c) {
            if (count == 0) {
              places.push_back(-1);
              continue;
            }
            int32_t& number = numbers[its_which[c]];
            if (number < 0) {
              number = static_cast<int32_t>(chosen.size());
              chosen.push_back(first + its_which[c]);
            }
            places.push_back(number);
          }
        }
        const auto count = static_cast<int64_t>(chosen.size());
        if (count == 0) return;
        const at::Tensor some = rows.index_select(0, at::from_blob(chosen.data(), {count}, at::kLong)),
                         slope = at::mm(some, hidden_transposed), activations = at::empty_like(slope),
                         activation_grads = at::zeros_like(slope);
        at::Tensor normalized, inverse_deviations;
        if (has_norm) {
          inverse_deviations = at::empty({count}, options);
          host::bias_norm(read(slope), read(hidden_bias), count, hidden, write(slope), write(inverse_deviations));
          normalized = slope.clone();
        }
        host::bias_gelu(read(slope), read(gelu_bias), count, hidden, write(activations), write(slope));
        host::largest_members_backward(read(grad, begin), places.data(), end - begin, channels, hidden, read(weight),
                                       read(activations), write(activation_grads), write(weight_sums, part));
        host::bias_gelu_backward(read(slope), read(activation_grads), count, hidden, write(activation_grads),
                                 write(has_norm ? gelu_bias_sums : hidden_bias_sums, part));
        if (has_norm) {
          host::bias_norm_backward(read(normalized), read(inverse_deviations), read(activation_grads), count, hidden,
                                   write(activation_grads), write(hidden_bias_sums, part));
        }
        at::Tensor hidden_sum = hidden_weight_sum;
        at::addmm_out(hidden_sum, hidden_sum, activation_grads.t(), some);
      };
    });
    const at::Tensor none;
    return {none,
            none,
            none,
            none,
            hidden_weight_sums.sum(0),
            hidden_bias_sums.sum(0),
            weight_sums.sum(0),
            at::mm(counts.gt(0).to(grad.scalar_type()).unsqueeze(0), grad).squeeze(0)};
  }

 private:
  // Returns the bias that the GELU adds: zeros if there is a norm, because the norm has already added the bias.
  static at::Tensor gelu_bias_of(const at::Tensor& hidden_bias, bool has_norm) {
    return has_norm ? at::zeros_like(hidden_bias) : hidden_bias;
  }
  // Returns the offset of each set's members among all members, followed by the total number.
  static std::vector<int64_t> begins_of(const at::Tensor& counts) {
    std::vector<int64_t> begins{0};
    const int32_t* const its_counts = counts.const_data_ptr<int32_t>();
    for (int64_t i = 0; i < counts.size(0); ++i) begins.push_back(begins.back() + its_counts[i]);
    return begins;
  }
};

// Whether layers on a device compute in bf16.
bool is_bf16_on_device(const at::Tensor& x) {
  return x.is_cuda() && at::autocast::is_autocast_enabled(at::kCUDA) &&
         at::autocast::get_autocast_dtype(at::kCUDA) == at::kBFloat16;
}

// Implementation of largest_embedding() on a device, with one forward and one backward pass. The backward pass
// recomputes the activations of members that are the largest in at least one channel.
struct DeviceSets : Function<DeviceSets> {
  /// Returns the largest embeddings. If `which_out` is not null, it gets the index of the largest member, u8 [sets,
  /// channels].
  static at::Tensor compute(const at::Tensor& members, const at::Tensor& counts, const SetSize& size,
                            const at::Tensor& hidden_weight, const at::Tensor& hidden_bias, const at::Tensor& weight,
                            const at::Tensor& bias, at::Tensor* which_out) {
    const at::TensorOptions options = members.options().requires_grad(false);
    at::Tensor out = at::empty({size.sets(), size.channels}, options.dtype(at::kBFloat16));
    if (which_out) *which_out = at::empty(out.sizes(), options.dtype(at::kByte));
    passes_on(members.device())
        ->largest_embedding(size, floats_of(members), counts.const_data_ptr<int32_t>(),
                            {floats_of(hidden_weight), floats_of(hidden_bias), floats_of(weight), floats_of(bias)},
                            out.mutable_data_ptr(), which_out ? which_out->mutable_data_ptr<uint8_t>() : nullptr,
                            stream_on(members.device()));
    return out;
  }

  static at::Tensor forward(AutogradContext* context, const at::Tensor& members, const at::Tensor& counts,
                            const SetSize& size, const at::Tensor& hidden_weight, const at::Tensor& hidden_bias,
                            const at::Tensor& weight, const at::Tensor& bias) {
    at::Tensor which;
    const at::Tensor out = compute(members, counts, size, hidden_weight, hidden_bias, weight, bias, &which);
    // An autograd context can only store tensors, so the size is stored as bytes.
    const at::Tensor size_bytes = at::empty({sizeof(SetSize)}, at::kByte);
    std::memcpy(size_bytes.mutable_data_ptr(), &size, sizeof(SetSize));
    context->save_for_backward({members, which, hidden_weight, hidden_bias, weight, bias, size_bytes});
    return out;
  }

  static variable_list backward(AutogradContext* context, const variable_list& grads) {
    const variable_list saved = context->get_saved_variables();
    const at::Tensor &members = saved[0], &which = saved[1], grad = grads[0].to(at::kBFloat16).contiguous();
    SetSize size;
    std::memcpy(&size, saved[6].const_data_ptr(), sizeof(SetSize));
    const auto sums_of = [&](const at::Tensor& parameter) {
      std::vector<int64_t> shape{SetSize::kSums};
      shape.insert(shape.end(), parameter.sizes().begin(), parameter.sizes().end());
      return at::empty(shape, parameter.options().requires_grad(false));
    };
    const at::Tensor &hidden_weight = saved[2], &hidden_bias = saved[3], &weight = saved[4], &bias = saved[5];
    const at::Tensor hidden_weight_sums = sums_of(hidden_weight), hidden_bias_sums = sums_of(hidden_bias),
                     weight_sums = sums_of(weight), bias_sums = sums_of(bias);
    passes_on(members.device())
        ->largest_embedding_backward(
            size, floats_of(members),
            {floats_of(hidden_weight), floats_of(hidden_bias), floats_of(weight), floats_of(bias)},
            which.const_data_ptr<uint8_t>(), grad.const_data_ptr(),
            {hidden_weight_sums.mutable_data_ptr<float>(), hidden_bias_sums.mutable_data_ptr<float>(),
             weight_sums.mutable_data_ptr<float>(), bias_sums.mutable_data_ptr<float>()},
            stream_on(members.device()));
    const at::Tensor none;
    return {none, none, none, hidden_weight_sums.sum(0), hidden_bias_sums.sum(0), weight_sums.sum(0), bias_sums.sum(0)};
  }
};

// Reorders [views, cameras, 3, ...] -> [cameras * views, 3, ...].
at::Tensor by_camera(const at::Tensor& images) { return images.transpose(0, 1).flatten(0, 1); }

at::Tensor host_patches(const at::Tensor& images, int64_t patch_px) {
  const at::Tensor from = images.contiguous();
  const PatchSize size{from.size(0), from.size(1), from.size(3), from.size(4), patch_px};
  const at::Tensor out =
      at::empty({size.cameras * size.views, size.rows(), size.columns(), 3 * patch_px * patch_px}, at::kFloat);
  const int64_t image_bytes = from.stride(0);
  for (int64_t camera = 0; camera < size.cameras; ++camera) {
    Blocks(size.views, host::kBlockNumbers / (size.rows() * size.columns())).run([&](int64_t) {
      return [&](int64_t begin, int64_t end) {
        host::patches(from.const_data_ptr<uint8_t>() + begin * image_bytes, end - begin, size.cameras, camera,
                      size.height_px, size.width_px, patch_px, write(out, camera * size.views + begin));
      };
    });
  }
  return out.permute({0, 3, 1, 2});
}

at::Tensor space_to_depth(const at::Tensor& images, int64_t patch_px) {
  if (patch_px == 1) return images;
  const int64_t channels = images.size(1), height = images.size(2), width = images.size(3);
  const int64_t rows = (height + patch_px - 1) / patch_px, columns = (width + patch_px - 1) / patch_px;
  // [n, c, rows, patch, columns, patch] -> [n, rows, columns, c, patch, patch], then channels first with channels last
  // in memory.
  return at::constant_pad_nd(images, {0, columns * patch_px - width, 0, rows * patch_px - height})
      .view({-1, channels, rows, patch_px, columns, patch_px})
      .permute({0, 2, 4, 1, 3, 5})
      .reshape({-1, rows, columns, channels * patch_px * patch_px})
      .permute({0, 3, 1, 2});
}

}  // namespace

at::Tensor linear_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias) {
  if (is_on_host(x)) return host_bias_gelu(at::linear(x, weight), bias);
  if (!x.is_cuda() || !NetworkPasses::supports_gelu(bias.size(0))) return gelu(at::linear(x, weight, bias));
  return BiasGelu<false>::apply(at::linear(x, weight), bias);
}

at::Tensor normalize(const at::Tensor& x) {
  // Autocast would convert x to fp32 and back, with two more passes forward and two backward. Without autocast, sums
  // are in fp32 too.
  const c10::impl::ExcludeDispatchKeyGuard no_autocast(c10::autocast_dispatch_keyset);
  return at::layer_norm(x, {x.size(-1)});
}

at::Tensor linear_norm_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias) {
  if (!x.is_cuda() || !NetworkPasses::supports_norm(bias.size(0))) return gelu(normalize(at::linear(x, weight, bias)));
  return BiasGelu<true>::apply(at::linear(x, weight), bias);
}

namespace {

// Returns a convolution's weight with zeros for its missing last input channels.
at::Tensor with_all_inputs(const at::Tensor& weight, int64_t channels) {
  const int64_t missing = channels - weight.size(1);
  return missing > 0 ? at::constant_pad_nd(weight, {0, 0, 0, 0, 0, missing}) : weight;
}

}  // namespace

at::Tensor convolve_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride) {
  const int64_t padding = weight.size(2) / 2;
  const at::Tensor padded = with_all_inputs(weight, x.size(1));
  if (is_on_host(x)) {
    const auto channels_last = [](const at::Tensor& t) { return t.permute({0, 2, 3, 1}).contiguous(); };
    const auto convolve = [&]<typename Convolution>(const at::Tensor& images) {
      return keeps_gradients({x, weight, bias})
                 ? Convolution::apply(images, padded, bias, stride)
                 : Convolution::compute(images, padded, bias, stride, /*slope_out=*/nullptr);
    };
    at::Tensor out;
    if (const at::Tensor images = channels_last(x); HostDirectConvolution::supports(images, weight))
      out = convolve.template operator()<HostDirectConvolution>(images);
    else if (bias.size(0) < HostConvolution::kMinOutputs)
      out = host_bias_gelu(channels_last(at::conv2d(x, padded, {}, {stride}, {padding})), bias);
    else
      out = convolve.template operator()<HostConvolution>(images);
    return out.permute({0, 3, 1, 2});
  }
  if (!x.is_cuda() || !NetworkPasses::supports_gelu(bias.size(0))) {
    return gelu(at::conv2d(x, padded, bias, {stride}, {padding}));
  }
  const at::Tensor rows = at::conv2d(x, padded, {}, {stride}, {padding}).permute({0, 2, 3, 1}).contiguous();
  return BiasGelu<false>::apply(rows, bias).permute({0, 3, 1, 2});
}

at::Tensor convolve_norm_gelu(const at::Tensor& x, const at::Tensor& weight, const at::Tensor& bias, int64_t stride) {
  const int64_t padding = weight.size(2) / 2;
  const at::Tensor padded = with_all_inputs(weight, x.size(1));
  const bool is_fused = x.is_cuda() && NetworkPasses::supports_norm(bias.size(0));
  const at::Tensor rows = at::conv2d(x, padded, is_fused ? std::optional<at::Tensor>() : bias, {stride}, {padding})
                              .permute({0, 2, 3, 1})
                              .contiguous();
  return (is_fused ? BiasGelu<true>::apply(rows, bias) : gelu(normalize(rows))).permute({0, 3, 1, 2});
}

at::Tensor norm(const at::Tensor& x, const at::Tensor& position, const at::Tensor& weight, const at::Tensor& bias) {
  if (!is_supported(x) || !NetworkPasses::supports_norm(x.size(-1))) {
    return at::layer_norm(position.defined() ? x + position : x, {x.size(-1)}, weight, bias);
  }
  std::optional<at::Tensor> added;
  if (position.defined()) added = position.to(x.scalar_type()).contiguous();
  return Norm::apply(x.contiguous(), added, weight, bias);
}

bool has_fused_set_encoder(const at::Tensor& members, const RowFeatures& features, const at::Tensor& hidden_weight,
                           const at::Tensor& weight) {
  if (is_on_host(members)) return true;
  return is_bf16_on_device(members) && members.scalar_type() == at::kFloat &&
         SetSize::supports(weight.size(0), hidden_weight.size(0), members.size(2) + features.count(),
                           members.size(1)) &&
         passes_on(members.device())->fits_set_encoder(weight.size(0));
}

at::Tensor largest_embedding(const at::Tensor& members, const at::Tensor& counts, const RowFeatures& features,
                             bool has_norm, const at::Tensor& hidden_weight, const at::Tensor& hidden_bias,
                             const at::Tensor& weight, const at::Tensor& bias) {
  const at::Tensor all = members.contiguous();
  const bool has_way_back = keeps_gradients({hidden_weight, hidden_bias, weight, bias});
  if (members.is_cuda()) {
    const SetSize size{row_size(members, features, /*keeps_rows=*/true), members.size(1), counts.stride(0), has_norm,
                       weight.size(0)};
    if (has_way_back) return DeviceSets::apply(all, counts, size, hidden_weight, hidden_bias, weight, bias);
    return DeviceSets::compute(all, counts, size, hidden_weight, hidden_bias, weight, bias, nullptr);
  }
  const at::Tensor its_counts = counts.contiguous();
  if (has_way_back)
    return HostSets::apply(all, its_counts, features, has_norm, hidden_weight, hidden_bias, weight, bias);
  return HostSets::compute(all, its_counts, features, has_norm, hidden_weight, hidden_bias, weight, bias)[0];
}

at::Tensor token_softmax(const at::Tensor& scores) {
  if (!is_supported(scores) || scores.size(2) % 2 != 0) return at::_softmax(scores, 1, /*half_to_float=*/false);
  return TokenSoftmax::apply(scores.contiguous());
}

bool has_fused_row_features(const at::Tensor& rows, const RowFeatures& features) {
  return rows.is_cuda() && rows.scalar_type() == at::kFloat && rows.size(-1) + features.count() <= RowSize::kMaxWidth;
}

at::Tensor feature_rows(const at::Tensor& rows, const RowFeatures& features, bool keeps_rows, at::ScalarType type) {
  const RowSize size = row_size(rows, features, keeps_rows);
  std::vector<int64_t> shape = rows.sizes().vec();
  shape.back() = size.width();
  at::Tensor out = at::empty(shape, rows.options().dtype(type));
  passes_on(rows.device())
      ->row_features(size, rows.contiguous().const_data_ptr<float>(), activation_type_of(type), out.mutable_data_ptr(),
                     stream_on(rows.device()));
  return out;
}

at::Tensor image_patches(const at::Tensor& images, int64_t patch_px, at::ScalarType type) {
  if (images.is_cpu() && type == at::kFloat && PatchSize::supports(patch_px)) return host_patches(images, patch_px);
  if (!images.is_cuda() || !PatchSize::supports(patch_px)) {
    return space_to_depth(by_camera(images), patch_px)
        .to(type, /*non_blocking=*/false, /*copy=*/false, at::MemoryFormat::ChannelsLast);
  }
  const PatchSize size{images.size(0), images.size(1), images.size(3), images.size(4), patch_px};
  const at::Tensor out =
      at::empty({size.cameras * size.views, size.rows(), size.columns(), PatchSize::channels_of(patch_px)},
                images.options().dtype(type));
  passes_on(images.device())
      ->patches(size, images.contiguous().const_data_ptr<uint8_t>(), activation_type_of(type), out.mutable_data_ptr(),
                stream_on(images.device()));
  return out.permute({0, 3, 1, 2});
}

}  // namespace pictura
