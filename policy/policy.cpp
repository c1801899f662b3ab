#include "pictura/policy/policy.h"

#include <cmath>
#include <numbers>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/common/support/hash.h"
#include "pictura/policy/image_backbone.h"
#include "pictura/policy/layers.h"
#include "pictura/policy/network_shape.h"
#include "pictura/policy/patch_spread.h"
#include "pictura/policy/precision.h"
#include "pictura/policy/row_features.h"
#include "pictura/policy/rules/network_passes.h"
#include "pictura/policy/torch_device.h"

namespace pictura {

/// Initializes parameters with random numbers, in the order of calls, and stores them with their names.
class ParameterMaker {
 public:
  ParameterMaker(uint64_t seed, const at::TensorOptions& options, std::vector<NamedTensor>* parameters_out)
      : seed_(seed), options_(options), parameters_(parameters_out) {}

  /// Draws a parameter from a normal distribution with standard deviation gain / sqrt(fan_in), where fan_in is the
  /// product of all dimensions except the first.
  at::Tensor normal(const std::string& name, at::IntArrayRef shape, double gain) {
    const at::Tensor drawn = at::empty(shape, at::kFloat);
    const double deviation = gain / std::sqrt(static_cast<double>(drawn.numel() / shape[0]));
    float* values = drawn.data_ptr<float>();
    for (int64_t i = 0; i < drawn.numel(); ++i) {
      // Box-Muller transform, with one random stream per element.
      RandomStream stream({.seed = seed_,
                           .world = static_cast<uint32_t>(parameters_->size()),
                           .episode = static_cast<uint32_t>(i),
                           .purpose = Purpose::parameters});
      const double radius = std::sqrt(-2.0 * std::log(1.0 - stream.uniform()));
      const double angle = 2.0 * std::numbers::pi * stream.uniform();
      values[i] = static_cast<float>(deviation * radius * std::cos(angle));
    }
    return add(name, drawn);
  }
  at::Tensor constant(const std::string& name, at::IntArrayRef shape, double value) {
    return add(name, at::full(shape, value, at::kFloat));
  }

  at::Tensor add(const std::string& name, const at::Tensor& first_value) {
    at::Tensor parameter = first_value.to(options_);
    parameter.requires_grad_();
    parameters_->push_back({name, parameter});
    return parameter;
  }

  /// Type and device of all parameters.
  const at::TensorOptions& options() const { return options_; }
  /// Adds parameters that are not drawn, for instance those of a program.
  void add_parameters(const std::vector<NamedTensor>& parameters) {
    parameters_->insert(parameters_->end(), parameters.begin(), parameters.end());
  }

  PolicyNetwork::Linear linear(const std::string& name, int64_t in, int64_t out, double gain) {
    return {normal(name + ".weight", {out, in}, gain), constant(name + ".bias", {out}, 0)};
  }
  /// Creates the paper's encoder of a group of features, a 2-layer MLP.
  PolicyNetwork::GroupEncoder group(const std::string& name, int64_t in, const PolicySection& config) {
    const int64_t width = config.embedding_width;
    return {linear(name + ".hidden", in, width, std::numbers::sqrt2), linear(name + ".out", width, width, 1.0),
            config.layer_norm};
  }

 private:
  uint64_t seed_;
  at::TensorOptions options_;  // type and device of parameters
  std::vector<NamedTensor>* parameters_;
};

namespace {

template <typename Linear>
at::Tensor apply(const Linear& layer, const at::Tensor& x) {
  return at::linear(x, layer.weight, layer.bias);
}
template <typename Linear>
at::Tensor apply_gelu(const Linear& layer, const at::Tensor& x) {
  return linear_gelu(x, layer.weight, layer.bias);
}

template <typename GroupEncoder>
at::Tensor encode(const GroupEncoder& group, const at::Tensor& x) {
  const auto hidden = group.layer_norm ? linear_norm_gelu : linear_gelu;
  return apply(group.out, hidden(x, group.hidden.weight, group.hidden.bias));
}

}  // namespace

at::Tensor masked_max(const at::Tensor& members, const at::Tensor& counts) {
  const at::Tensor index = at::arange(members.size(1), counts.options());
  const at::Tensor is_padding = index.unsqueeze(0) >= counts.unsqueeze(1);
  const at::Tensor largest =
      members.masked_fill(is_padding.unsqueeze(2), -std::numeric_limits<double>::infinity()).amax(1);
  return largest.masked_fill((counts == 0).unsqueeze(1), 0);
}

/// Encodes the entity sets of simulator/observation.h. Each set has an MLP, which embeds its members; the embedding of
/// the set is their channel-wise maximum.
class VectorEncoder final : public SceneEncoder {
 public:
  /// Creates the encoder. Members with features are converted to `input_type`.
  VectorEncoder(const PolicySection& config, bool reads_walls, at::ScalarType input_type, ParameterMaker* make)
      : embedding_width_(config.embedding_width), input_type_(input_type) {
    for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
      const ObservationArray& array = kObservationArrays[i];
      if (!is_set(array) || (array.part == ObservationPart::walls && !reads_walls)) continue;
      const RowFeatures features = row_features_of(config, array.name);
      groups_.push_back({make->group(std::string(array.name), array.features + features.count(), config),
                         kObservationTensors[i], entity_set_of(i), features});
    }
  }

  at::Tensor forward(const Observation& o) const override {
    std::vector<at::Tensor> embeddings;
    for (const Group& group : groups_) {
      at::Tensor members = o.*group.members;
      const at::Tensor counts = o.set_counts.select(1, group.set);
      const PolicyNetwork::Linear &hidden = group.encoder.hidden, &out = group.encoder.out;
      if (has_fused_set_encoder(members, group.features, hidden.weight, out.weight)) {
        embeddings.push_back(largest_embedding(members, counts, group.features, group.encoder.layer_norm, hidden.weight,
                                               hidden.bias, out.weight, out.bias));
        continue;
      }
      if (group.features.count() > 0) members = with_row_features(members, group.features, input_type_);
      embeddings.push_back(masked_max(encode(group.encoder, members), counts));
    }
    return at::cat(embeddings, 1);
  }

  int64_t width() const override { return static_cast<int64_t>(groups_.size()) * embedding_width_; }

 private:
  struct Group {
    PolicyNetwork::GroupEncoder encoder;
    at::Tensor Observation::* members;
    int64_t set;  // column of set_counts
    RowFeatures features;
  };
  int64_t embedding_width_;
  at::ScalarType input_type_;
  std::vector<Group> groups_;
};

/// Encodes images. Convolutions or a pretrained program, shared by all cameras, compute feature maps. For each camera,
/// learned queries attend to the feature map, and their results are averaged or concatenated. The results of all
/// cameras are concatenated and projected to the width of the four sets that they replace.
class PerspectiveEncoder final : public SceneEncoder {
 public:
  /// Creates the encoder. Images are converted to `image_type`.
  PerspectiveEncoder(const PolicySection& config, int num_cameras, at::ScalarType image_type, ParameterMaker* make)
      : config_(config),
        num_cameras_(num_cameras),
        image_type_(image_type),
        backbone_(load_backbone(config, make->options())),
        width_(backbone_ ? backbone_->channels() : config.conv_channels.back()) {
    if (backbone_) make->add_parameters(backbone_->parameters());
    int64_t in = 3 * int64_t{config.patch_px} * config.patch_px;
    for (size_t i = 0; i < config.conv_channels.size() && !backbone_; ++i) {
      const int64_t out = config.conv_channels[i], kernel = config.conv_kernels[i];
      const std::string name = fmt::format("conv.{}", i);
      convolutions_.push_back({make->normal(name + ".weight", {out, in, kernel, kernel}, std::numbers::sqrt2),
                               make->constant(name + ".bias", {out}, 0)});
      in = out;
    }
    position_ = make->linear("attention.position", kPositionFeatures, width_, 0.5);
    token_norm_ = make_norm("attention.token_norm", make);
    queries_ = make->normal("attention.queries", {num_cameras, config.num_queries, width_}, std::sqrt(double(width_)));
    query_norm_ = make_norm("attention.query_norm", make);
    query_ = make->linear("attention.query", width_, width_, 1.0);
    key_ = make->normal("attention.key.weight", {width_, width_}, 1.0);
    value_ = make->linear("attention.value", width_, width_, 1.0);
    out_ = make->linear("attention.out", width_, width_, 1.0);
    if (config.attention_mlp > 0) {
      mlp_norm_ = make_norm("attention.mlp_norm", make);
      mlp_hidden_ = make->linear("attention.mlp_hidden", width_, config.attention_mlp, std::numbers::sqrt2);
      mlp_out_ = make->linear("attention.mlp_out", config.attention_mlp, width_, 1.0);
    }
    project_ =
        make->linear("project", num_cameras * num_features() * width_, width(), std::sqrt(double(num_features())));
  }

  int64_t width() const override { return 4 * int64_t{config_.embedding_width}; }
  const ImageBackbone* image_backbone() const override { return backbone_.get(); }
  static_assert(PatchSize::channels_of(4) == patch_values(4) && PatchSize::channels_of(8) == patch_values(8) &&
                    PatchSize::channels_of(12) == patch_values(12) && PatchSize::channels_of(16) == patch_values(16),
                "renderers draw what image_patches() makes");
  int drawn_patch_px() const override {
    return !backbone_ && is_drawn_patch(patch_px()) && image_type_ == at::kBFloat16 ? patch_px() : 0;
  }

  at::Tensor forward(const Observation& o) const override {
    std::vector<at::Tensor> per_camera(static_cast<size_t>(num_cameras_));
    for (const ImageBlock& block : o.images) {
      const at::Tensor pooled = pool(block);
      for (size_t i = 0; i < block.cameras.size(); ++i) {
        per_camera[block.cameras[i]] = pooled.select(0, static_cast<int64_t>(i));
      }
    }
    return apply(project_, at::cat(per_camera, 1));
  }

 private:
  struct Norm {
    at::Tensor weight, bias;
  };
  Norm make_norm(const std::string& name, ParameterMaker* make) const {
    return {make->constant(name + ".weight", {width_}, 1), make->constant(name + ".bias", {width_}, 0)};
  }
  static at::Tensor apply_norm(const Norm& n, const at::Tensor& x, const at::Tensor& position) {
    return norm(x, position, n.weight, n.bias);
  }

  static at::Tensor position_features(int64_t height, int64_t width, const at::TensorOptions& options) {
    auto axis = [&](int64_t size) { return (at::arange(size, options) + 0.5) * (std::numbers::pi / double(size)); };
    const at::Tensor y = axis(height).unsqueeze(1).expand({height, width}).flatten();
    const at::Tensor x = axis(width).unsqueeze(0).expand({height, width}).flatten();
    return at::stack({x.cos(), y.cos(), x.sin(), y.sin(), (2 * x).cos(), (2 * y).cos(), (2 * x).sin(), (2 * y).sin()},
                     1);
  }

  static std::unique_ptr<ImageBackbone> load_backbone(const PolicySection& config, const at::TensorOptions& options) {
    if (config.backbone == "conv") return nullptr;
    auto backbone = std::make_unique<ImageBackbone>(config.backbone, options, config.backbone_frozen);
    PICTURA_CHECK(backbone->channels() % config.attention_heads == 0,
                  "{}: has {} channels: expected a multiple of policy.attention_heads ({})", config.backbone,
                  backbone->channels(), config.attention_heads);
    return backbone;
  }

  // Side of the patches that the first convolution reads: policy.patch_px, or a larger side if the convolution was
  // spread.
  int patch_px() const { return patch_side_px(convolutions_[0].weight.size(1)); }

  // Returns feature maps [cameras * batch, width, rows, columns], channels last in memory. images: as in ImageBlock.
  at::Tensor convolve(const at::Tensor& images) const {
    const bool are_patches = images.scalar_type() != at::kByte;
    at::Tensor x = are_patches ? images.transpose(0, 1).flatten(0, 1).permute({0, 3, 1, 2})
                               : image_patches(images, patch_px(), image_type_);
    for (size_t i = 0; i < convolutions_.size(); ++i) {
      // Pixels are 0 to 255. Scaling the few weights is cheaper than scaling the pixels.
      const at::Tensor weight = i == 0 ? convolutions_[i].weight / 255.0 : convolutions_[i].weight;
      const auto layer = config_.conv_norm ? convolve_norm_gelu : convolve_gelu;
      x = layer(x, weight, convolutions_[i].bias, config_.conv_strides[i]);
    }
    return x;
  }

  int64_t num_features() const { return num_camera_features(config_); }

  // Returns the features of a block's cameras, [cameras, batch, num_features() * width]. A mean over queries is
  // computed before the MLP's last layer, which is linear, so that this layer processes one row instead of num_queries
  // rows.
  at::Tensor pool(const ImageBlock& block) const {
    const int64_t batch = block.pixels.size(0), cameras = block.pixels.size(1);
    const at::Tensor x = backbone_ ? backbone_->forward(block.pixels) : convolve(block.pixels);
    const at::Tensor where = apply(position_, position_features(x.size(2), x.size(3), queries_.options()));
    const at::Tensor tokens = apply_norm(token_norm_, x.permute({0, 2, 3, 1}).flatten(1, 2), where);

    std::vector<at::Tensor> of_cameras;
    for (const int64_t camera : block.cameras) of_cameras.push_back(queries_.select(0, camera));
    const at::Tensor queries = at::stack(of_cameras);
    at::Tensor pooled = attend(queries, tokens).unflatten(0, {cameras, batch});
    pooled = pooled + queries.unsqueeze(1).to(pooled.scalar_type());
    const auto averaged = [&](const at::Tensor& t) {
      return config_.concatenate_queries ? t : t.mean(2, /*keepdim=*/true);
    };
    at::Tensor features = averaged(pooled);
    if (config_.attention_mlp > 0) {
      const at::Tensor hidden = apply_gelu(mlp_hidden_, apply_norm(mlp_norm_, pooled, {}));
      features = features + apply(mlp_out_, averaged(hidden));
    }
    // Concatenated features are the parts of a mean, so that the next layer's inputs and its steps in training are as
    // small.
    if (num_features() > 1) features = features / double(num_features());
    return features.flatten(2);
  }

  // Computes the attention of each camera's queries, [cameras, queries, width], to the tokens of its images, [cameras *
  // batch, tokens, width]. Returns [cameras * batch, queries, width]. Queries are parameters, equal for all images, so
  // keys and values of single tokens need not be computed. Scores are (q W) t instead of q (W t). The value and output
  // layers are one product, applied to the weighted sums of tokens. There is no key bias, because it would add the same
  // number to all scores of a query, which does not change the softmax. The value bias is added once, because attention
  // weights sum to 1.
  at::Tensor attend(const at::Tensor& queries, const at::Tensor& tokens) const {
    const int64_t cameras = queries.size(0), heads = config_.attention_heads, head_width = width_ / heads;
    const at::Tensor key = key_.unflatten(0, {heads, head_width});
    const at::Tensor value = value_.weight.unflatten(0, {heads, head_width});
    const at::Tensor out = out_.weight.unflatten(1, {heads, head_width}).transpose(0, 1);

    const at::Tensor q = apply(query_, apply_norm(query_norm_, queries, {})).unflatten(-1, {heads, 1, head_width});
    const at::Tensor asked = (at::matmul(q, key) / std::sqrt(double(head_width))).flatten(1, 3);
    const at::Tensor scores = at::bmm(tokens.view({cameras, -1, width_}), asked.transpose(1, 2))
                                  .view({tokens.size(0), tokens.size(1), config_.num_queries * heads});
    const at::Tensor sums = at::bmm(token_softmax(scores).transpose(1, 2), tokens)
                                .view({tokens.size(0), config_.num_queries, heads * width_});
    return at::linear(sums, at::matmul(out, value).transpose(0, 1).flatten(1), apply(out_, value_.bias));
  }

  const PolicySection config_;
  const int num_cameras_;
  const at::ScalarType image_type_;
  const std::unique_ptr<ImageBackbone> backbone_;  // null: convolutions are used
  const int64_t width_;
  std::vector<PolicyNetwork::Linear> convolutions_;  // weights are [out, in, kernel, kernel]
  at::Tensor queries_, key_;
  Norm token_norm_, query_norm_, mlp_norm_;
  PolicyNetwork::Linear position_, query_, value_, out_, mlp_hidden_, mlp_out_, project_;
};

PolicyNetwork::PolicyNetwork(const PolicySection& config, int num_cameras, uint64_t seed, at::ScalarType type,
                             bool reads_walls, Device device, Precision precision)
    : type_(type),
      precision_(precision),
      waypoint_features_(row_features_of(config, "waypoints")),
      layer_norm_(config.layer_norm),
      residual_(config.residual) {
  ParameterMaker make(seed, at::TensorOptions(type).device(torch_device(device)), &parameters_);
  const bool sees_images = config.modality == Modality::perspective;
  const at::ScalarType input_type = precision == Precision::bf16 ? at::kBFloat16 : type;
  if (sees_images)
    scene_ = std::make_unique<PerspectiveEncoder>(config, num_cameras, input_type, &make);
  else
    scene_ = std::make_unique<VectorEncoder>(config, reads_walls, input_type, &make);
  num_scene_parameters_ = std::ssize(parameters_);
  ego_features_ = num_ego_features(sees_images);
  ego_ = make.group("ego", ego_features_, config);
  conditioning_ = make.group(
      "conditioning", kNumConditioning + kNumWaypoints * (kWaypointFeatures + waypoint_features_.count()), config);
  const int64_t in = scene_->width() + 2 * int64_t{config.embedding_width}, inside = config.backbone_width;
  for (int i = 0; i < config.backbone_layers; ++i) {
    backbone_.push_back(make.linear(fmt::format("backbone.{}", i), i == 0 ? in : inside, inside, std::numbers::sqrt2));
  }
  // The initial weights of the actor head are small, so that all actions are about equally likely at first.
  actor_ = make.linear("actor", inside, kNumActions, 0.01);
  critic_ = make.linear("critic", inside, 1, 1.0);
}

at::Tensor PolicyNetwork::run_trunk(at::Tensor x) const {
  for (size_t i = 0; i < backbone_.size(); ++i) {
    // The input of the first layer, the concatenated outputs of the encoders, has another width.
    const bool is_first = i == 0;
    const at::Tensor y = apply_gelu(backbone_[i], layer_norm_ && !is_first ? normalize(x) : x);
    x = residual_ && !is_first ? x + y : y;
  }
  return layer_norm_ ? normalize(x) : x;
}

Policy::Output PolicyNetwork::forward(const Observation& o) const {
  std::vector<at::Tensor> own{o.conditioning, o.waypoints};
  if (waypoint_features_.count() > 0) {
    own.push_back(row_features(o.waypoints.unflatten(1, {kNumWaypoints, kWaypointFeatures}), waypoint_features_,
                               o.waypoints.scalar_type())
                      .flatten(1));
  }
  at::Tensor scene, x;
  {
    const LayerPrecision precision(precision_, o.ego.device().type());
    scene = scene_->forward(o);
    x = run_trunk(
        at::cat({scene, encode(ego_, o.ego.narrow(1, 0, ego_features_)), encode(conditioning_, at::cat(own, 1))}, 1));
  }
  return {apply(actor_, x.to(type_)), apply(critic_, x.to(type_)).squeeze(1), scene};
}

int64_t Policy::num_parameters() const {
  int64_t sum = 0;
  for (const NamedTensor& parameter : parameters_) sum += parameter.value.numel();
  return sum;
}

void scale_logits(const Policy& policy, double factor) {
  if (factor == 1) return;
  const at::NoGradGuard no_grad;
  for (const NamedTensor& parameter : policy.parameters()) {
    at::Tensor value = parameter.value;
    if (parameter.name.starts_with("actor.")) value.mul_(factor);
  }
}

std::string hash_of_parameters(const std::vector<NamedTensor>& parameters) {
  Hash64 hash;
  for (const NamedTensor& parameter : parameters) {
    const at::Tensor host = parameter.value.detach().cpu().contiguous();
    hash.add_bytes(host.const_data_ptr(), host.nbytes());
  }
  return hash.hex();
}

std::string Policy::hash() const { return hash_of_parameters(parameters_); }

std::string PolicyNetwork::backbone_hash() const {
  return scene_->image_backbone() ? scene_->image_backbone()->hash() : "";
}

void PolicyNetwork::check_images(const Rig& rig) const {
  if (scene_->image_backbone()) scene_->image_backbone()->check_images(rig);
}

int PolicyNetwork::drawn_patch_px() const { return scene_->drawn_patch_px(); }

std::unique_ptr<const Policy> make_policy(const Config& config, const Rig& rig, Device device) {
  auto policy = std::make_unique<PolicyNetwork>(config.policy, static_cast<int>(rig.cameras.size()), config.run.seed,
                                                at::kFloat, config.reads(ObservationPart::walls), device,
                                                device.is_host() ? Precision::fp32 : config.train.precision);
  policy->check_images(rig);
  return policy;
}

at::Tensor Decision::are_finite() const { return logits.isfinite().all().logical_and(value.isfinite().all()); }

Decision decide(const at::Tensor& rows, const ChunkSizes& chunks,
                const std::function<Policy::Output(const at::Tensor& rows)>& act, int64_t scene_width) {
  const at::NoGradGuard no_grad;
  const at::TensorOptions options = rows.options().dtype(at::kFloat);
  Decision decision{at::empty({rows.size(0), kNumActions}, options), {}, at::empty({rows.size(0)}, options)};
  if (scene_width > 0) decision.scene = at::empty({rows.size(0), scene_width}, options);
  for_each_chunk(rows, chunks, [&](const Chunk& chunk) {
    const Policy::Output output = act(chunk.rows);
    decision.logits.narrow(0, chunk.begin, chunk.count).copy_(output.logits.narrow(0, 0, chunk.count));
    decision.value.narrow(0, chunk.begin, chunk.count).copy_(output.value.narrow(0, 0, chunk.count));
    if (scene_width > 0)
      decision.scene.narrow(0, chunk.begin, chunk.count).copy_(output.scene.narrow(0, 0, chunk.count));
  });
  decision.log_probs = at::log_softmax(decision.logits, 1);
  return decision;
}

}  // namespace pictura
