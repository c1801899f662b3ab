#include "pictura/policy/host_network.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/common/patches.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/policy/host_passes.h"
#include "pictura/policy/host_product.h"
#include "pictura/policy/network_shape.h"
#include "pictura/policy/patch_spread.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/observation_arrays.h"

namespace pictura {

namespace {

using Numbers = std::vector<float>;

// Returns memory for at least `numbers` floats. Later calls return the same memory if it is large enough.
float* room(Numbers* memory, int64_t numbers) {
  if (memory->size() < static_cast<size_t>(numbers)) memory->resize(static_cast<size_t>(numbers));
  return memory->data();
}

/// Linear layer.
struct Dense {
  int64_t in = 0, out = 0;
  Numbers weight, bias;  // [in, out]; [out]

  /// x: [rows, in]; to: [rows, out].
  void apply(const float* x, int64_t rows, float* to) const {
    host::multiply({x, in}, weight.data(), rows, in, out, to);
    for (int64_t row = 0; row < rows; ++row) {
      for (int64_t c = 0; c < out; ++c) to[row * out + c] += bias[c];
    }
  }
  /// has_norm: whether a layer norm precedes the GELU.
  void apply_gelu(const float* x, int64_t rows, float* to, bool has_norm = false) const {
    host::multiply({x, in}, weight.data(), rows, in, out, to);
    if (!has_norm) return host::bias_gelu(to, bias.data(), rows, out, to, nullptr);
    host::bias_norm(to, bias.data(), rows, out, to, nullptr);
    const Numbers zeros(static_cast<size_t>(out));
    host::bias_gelu(to, zeros.data(), rows, out, to, nullptr);
  }
};

/// The paper's encoder of a group of features: two linear layers.
struct Group {
  Dense hidden, out;
  bool layer_norm = false;

  void apply_hidden(const float* x, int64_t rows, float* to) const { hidden.apply_gelu(x, rows, to, layer_norm); }
  Numbers encode(const float* x, int64_t rows) const {
    Numbers activations(static_cast<size_t>(rows * hidden.out)), result(static_cast<size_t>(rows * out.out));
    apply_hidden(x, rows, activations.data());
    out.apply(activations.data(), rows, result.data());
    return result;
  }
};

/// Layer norm of rows, in place; without parameters if `weight` is empty.
struct Norm {
  Numbers weight, bias;

  void apply(float* rows_inout, int64_t rows, int64_t channels) const {
    const Numbers zeros(static_cast<size_t>(channels));
    host::bias_norm(rows_inout, zeros.data(), rows, channels, rows_inout, nullptr);
    if (weight.empty()) return;
    for (int64_t row = 0; row < rows; ++row, rows_inout += channels) {
      for (int64_t c = 0; c < channels; ++c) rows_inout[c] = rows_inout[c] * weight[c] + bias[c];
    }
  }
};

/// Reader of a file's named parameters.
class ParameterReader {
 public:
  explicit ParameterReader(const StoredPolicy& saved) : saved_(saved) {}

  const Numbers& take(const std::string& name, const std::vector<int64_t>& shape) {
    ++taken_;
    return find_parameter(saved_.path, saved_.parameters, name, shape).values;
  }
  Dense linear(const std::string& name, int64_t in, int64_t out) {
    return {in, out, transposed(take(name + ".weight", {out, in}), out, in), take(name + ".bias", {out})};
  }
  Group group(const std::string& name, int64_t in, const PolicySection& config) {
    const int64_t width = config.embedding_width;
    return {linear(name + ".hidden", in, width), linear(name + ".out", width, width), config.layer_norm};
  }
  Norm norm(const std::string& name, int64_t width) {
    return {take(name + ".weight", {width}), take(name + ".bias", {width})};
  }
  int64_t shape_of(const std::string& name, size_t dimension) const {
    for (const StoredTensor& one : saved_.parameters) {
      if (one.name == name && one.shape.size() > dimension) return one.shape[dimension];
    }
    fail("{}: has a different architecture: no parameter '{}'", saved_.path, name);
  }
  /// Throws Error if the file has parameters that were not read.
  void finish() const { check_parameter_count(saved_.path, saved_.parameters.size(), taken_); }

  static Numbers transposed(const Numbers& matrix, int64_t rows, int64_t columns) {
    Numbers result(matrix.size());
    for (int64_t r = 0; r < rows; ++r) {
      for (int64_t c = 0; c < columns; ++c) result[c * rows + r] = matrix[r * columns + c];
    }
    return result;
  }

 private:
  const StoredPolicy& saved_;
  size_t taken_ = 0;
};

/// Encoder of entity sets, see VectorEncoder in policy.cpp.
class SetEncoder {
 public:
  SetEncoder(const Config& config, ParameterReader* read) : width_(config.policy.embedding_width) {
    for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
      const ObservationArray& array = kObservationArrays[i];
      if (!is_set(array) || !config.reads(array.part)) continue;
      const RowFeatures features = row_features_of(config.policy, array.name);
      const RowSize size{0, array.features, features, /*keeps_rows=*/true};
      groups_.push_back({read->group(std::string(array.name), size.width(), config.policy), size, array.rows,
                         entity_set_of(i), std::string(array.name)});
    }
  }

  int64_t width() const { return static_cast<int64_t>(groups_.size()) * width_; }

  /// Encodes agents [begin, begin + count) to [count, width()].
  void encode(const ObservationView& arrays, int64_t begin, int64_t count, float* to) const {
    Numbers rows, activations, embeddings, largest(static_cast<size_t>(count * width_));
    std::vector<int32_t> which(largest.size()), counts(static_cast<size_t>(count));
    for (size_t g = 0; g < groups_.size(); ++g) {
      const SetGroup& group = groups_[g];
      int64_t members = 0;
      for (int64_t i = 0; i < count; ++i) {
        counts[i] = arrays.set_counts[(begin + i) * kNumEntitySets + group.set];
        members += counts[i];
      }
      float* const its_rows = room(&rows, members * group.size.width());
      float* const hidden = room(&activations, members * width_);
      float* const its_embeddings = room(&embeddings, members * width_);
      host::member_rows(members_of(arrays, group) + begin * group.max_members * group.size.columns, counts.data(),
                        count, group.max_members, group.size, its_rows);
      group.encoder.apply_hidden(its_rows, members, hidden);
      host::multiply({hidden, width_}, group.encoder.out.weight.data(), members, width_, width_, its_embeddings);
      host::largest_members(its_embeddings, counts.data(), count, width_, largest.data(), which.data());
      for (int64_t i = 0; i < count; ++i) {
        for (int64_t c = 0; c < width_; ++c) {
          // The bias is added after the maximum, because it does not change which member is the largest.
          to[i * width() + static_cast<int64_t>(g) * width_ + c] =
              largest[i * width_ + c] + (counts[i] > 0 ? group.encoder.out.bias[c] : 0);
        }
      }
    }
  }

 private:
  struct SetGroup {
    Group encoder;
    RowSize size;
    int64_t max_members, set;  // max_members: rows of the set's array; set: column of set_counts
    std::string array;
  };
  static const float* members_of(const ObservationView& arrays, const SetGroup& group) {
    const void* data = nullptr;
#define X(name, type, rows, features, part, comment) \
  if (group.array == #name) data = arrays.name.data();
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    return static_cast<const float*>(data);
  }

  int64_t width_;
  std::vector<SetGroup> groups_;
};

/// Encoder of images: convolutions, and attention of learned queries over their output. See PerspectiveEncoder in
/// policy.cpp.
class ImageEncoder {
 public:
  ImageEncoder(const PolicySection& config, int num_cameras, ParameterReader* read)
      : config_(config),
        num_cameras_(num_cameras),
        width_(config.conv_channels.back()),
        patch_px_(patch_side_px(read->shape_of(kFirstConvolution, 1))) {
    int64_t in = 3 * int64_t{patch_px_} * patch_px_;
    for (size_t i = 0; i < config.conv_channels.size(); ++i) {
      const int64_t out = config.conv_channels[i], kernel = config.conv_kernels[i];
      const std::string name = fmt::format("conv.{}", i);
      const Numbers& weight = read->take(name + ".weight", {out, in, kernel, kernel});
      Dense layer{kernel * kernel * in, out, Numbers(weight.size()), read->take(name + ".bias", {out})};
      const float scale = i == 0 ? 255.0f : 1.0f;  // the first convolution reads pixels of 0 to 255
      for (int64_t o = 0; o < out; ++o) {
        for (int64_t c = 0; c < in; ++c) {
          for (int64_t tap = 0; tap < kernel * kernel; ++tap) {
            layer.weight[(tap * in + c) * out + o] = weight[(o * in + c) * kernel * kernel + tap] / scale;
          }
        }
      }
      convolutions_.push_back(std::move(layer));
      in = out;
    }
    position_ = read->linear("attention.position", kPositionFeatures, width_);
    token_norm_ = read->norm("attention.token_norm", width_);
    queries_ = read->take("attention.queries", {num_cameras, config.num_queries, width_});
    make_attention(read);
    if (config.attention_mlp > 0) {
      mlp_norm_ = read->norm("attention.mlp_norm", width_);
      mlp_hidden_ = read->linear("attention.mlp_hidden", width_, config.attention_mlp);
      mlp_out_ = read->linear("attention.mlp_out", config.attention_mlp, width_);
    }
    project_ = read->linear("project", pooled_width(), width());
  }

  int64_t width() const { return 4 * int64_t{config_.embedding_width}; }
  int64_t pooled_width() const { return num_cameras_ * camera_width(); }

  /// Returns the features of all images, [agents, pooled_width()], for encode().
  Numbers pool(const HostObservation& observation, int num_threads) {
    const int64_t of_agent = pooled_width();
    Numbers pooled(static_cast<size_t>(observation.agents * of_agent));
    scratch_.resize(static_cast<size_t>(resolve_num_threads(num_threads)));
    for (const HostImageBlock& block : observation.images) {
      const auto cameras = static_cast<int64_t>(block.cameras.size());
      const std::vector<host::ConvolutionSize> sizes = sizes_of(block);
      const Numbers where = positions(sizes.back().rows(), sizes.back().columns());
      const int64_t of_image = 3 * block.height_px * block.width_px;
      parallel_for(num_threads, observation.agents * cameras, [&](int64_t image, int thread) {
        const int camera = block.cameras[image % cameras];
        pool_image(block.pixels + image * of_image, block, sizes, where, camera, &scratch_[thread],
                   pooled.data() + image / cameras * of_agent + camera * camera_width());
      });
    }
    return pooled;
  }

  void encode(const float* pooled, int64_t count, float* to) const { project_.apply(pooled, count, to); }

 private:
  /// Working memory of one thread.
  struct Scratch {
    Numbers images, taps, next, scores, sums, attended, hidden;
  };

  // Folds the key weights into the queries, q (W t) = (q W) t, and the value weights into the output weights, as
  // PerspectiveEncoder::attend() does.
  void make_attention(ParameterReader* read) {
    const int64_t heads = config_.attention_heads, of_head = width_ / heads, queries = config_.num_queries;
    const Norm norm = read->norm("attention.query_norm", width_);
    const Dense query = read->linear("attention.query", width_, width_);
    const Numbers& key = read->take("attention.key.weight", {width_, width_});
    const Numbers& value = read->take("attention.value.weight", {width_, width_});
    const Numbers& value_bias = read->take("attention.value.bias", {width_});
    const Numbers& out = read->take("attention.out.weight", {width_, width_});
    const Numbers& out_bias = read->take("attention.out.bias", {width_});

    const int64_t rows = num_cameras_ * queries;
    Numbers normalized = queries_, q(queries_.size());
    norm.apply(normalized.data(), rows, width_);
    query.apply(normalized.data(), rows, q.data());
    asked_.resize(static_cast<size_t>(rows * heads * width_));
    for (int64_t row = 0; row < rows; ++row) {
      const int64_t camera = row / queries;
      for (int64_t head = 0; head < heads; ++head) {
        const int64_t column = row % queries * heads + head;
        for (int64_t c = 0; c < width_; ++c) {
          double sum = 0;
          for (int64_t j = head * of_head; j < (head + 1) * of_head; ++j) {
            sum += double{q[row * width_ + j]} * double{key[j * width_ + c]};
          }
          asked_[(camera * width_ + c) * queries * heads + column] =
              static_cast<float>(sum / std::sqrt(static_cast<double>(of_head)));
        }
      }
    }
    attended_ = {heads * width_, width_, Numbers(static_cast<size_t>(heads * width_ * width_)), Numbers(out_bias)};
    for (int64_t o = 0; o < width_; ++o) {
      double bias = out_bias[o];
      for (int64_t j = 0; j < width_; ++j) bias += double{out[o * width_ + j]} * double{value_bias[j]};
      attended_.bias[o] = static_cast<float>(bias);
      for (int64_t head = 0; head < heads; ++head) {
        for (int64_t c = 0; c < width_; ++c) {
          double sum = 0;
          for (int64_t j = head * of_head; j < (head + 1) * of_head; ++j) {
            sum += double{out[o * width_ + j]} * double{value[j * width_ + c]};
          }
          attended_.weight[(head * width_ + c) * width_ + o] = static_cast<float>(sum);
        }
      }
    }
  }

  std::vector<host::ConvolutionSize> sizes_of(const HostImageBlock& block) const {
    std::vector<host::ConvolutionSize> sizes;
    int64_t rows = patches_along(patch_px_, static_cast<int>(block.height_px)),
            columns = patches_along(patch_px_, static_cast<int>(block.width_px)), channels = patch_values(patch_px_);
    for (size_t i = 0; i < convolutions_.size(); ++i) {
      sizes.push_back({rows, columns, channels, config_.conv_kernels[i], config_.conv_strides[i]});
      rows = sizes.back().rows();
      columns = sizes.back().columns();
      channels = convolutions_[i].out;
    }
    return sizes;
  }

  // Returns the position embedding of each token of a feature map, [rows * columns, width_].
  Numbers positions(int64_t rows, int64_t columns) const {
    Numbers features;
    for (int64_t i = 0; i < rows * columns; ++i) {
      const double y = (static_cast<double>(i / columns) + 0.5) * (std::numbers::pi / static_cast<double>(rows));
      const double x = (static_cast<double>(i % columns) + 0.5) * (std::numbers::pi / static_cast<double>(columns));
      for (const double feature : {std::cos(x), std::cos(y), std::sin(x), std::sin(y), std::cos(2 * x), std::cos(2 * y),
                                   std::sin(2 * x), std::sin(2 * y)}) {
        features.push_back(static_cast<float>(feature));
      }
    }
    Numbers where(static_cast<size_t>(rows * columns * width_));
    position_.apply(features.data(), rows * columns, where.data());
    return where;
  }

  // Computes the features of one image. pixels: [3, height, width]; to: [width_].
  void pool_image(const uint8_t* pixels, const HostImageBlock& block, const std::vector<host::ConvolutionSize>& sizes,
                  const Numbers& where, int camera, Scratch* scratch, float* to) const {
    float* x = room(&scratch->images, sizes[0].height * sizes[0].width * sizes[0].channels);
    host::patches(pixels, 1, 1, 0, block.height_px, block.width_px, patch_px_, x);
    for (size_t i = 0; i < convolutions_.size(); ++i) {
      const host::ConvolutionSize& size = sizes[i];
      const float* taps = x;
      if (size.kernel > 1 || size.stride > 1) {
        float* const unfolded = room(&scratch->taps, size.pixels() * size.taps());
        host::unfold(size, x, 1, unfolded);
        taps = unfolded;
      }
      float* const next = room(&scratch->next, size.pixels() * convolutions_[i].out);
      convolutions_[i].apply_gelu(taps, size.pixels(), next, config_.conv_norm);
      std::swap(scratch->images, scratch->next);
      x = next;
    }
    const int64_t tokens = sizes.back().pixels(), queries = config_.num_queries,
                  columns = queries * config_.attention_heads;
    for (size_t i = 0; i < where.size(); ++i) x[i] += where[i];
    token_norm_.apply(x, tokens, width_);

    float* const scores = room(&scratch->scores, tokens * columns);
    host::multiply({x, width_}, asked_.data() + camera * width_ * columns, tokens, width_, columns, scores);
    softmax_over_rows(scores, tokens, columns);
    float* const sums = room(&scratch->sums, columns * width_);
    host::multiply({scores, 1, columns}, x, columns, tokens, width_, sums);
    float* const pooled = room(&scratch->attended, queries * width_);
    attended_.apply(sums, queries, pooled);
    const float* const its_queries = queries_.data() + camera * queries * width_;
    for (int64_t i = 0; i < queries * width_; ++i) pooled[i] += its_queries[i];
    average_queries(pooled, width_, to);
    if (config_.attention_mlp > 0) {
      mlp_norm_.apply(pooled, queries, width_);
      float* const hidden = room(&scratch->hidden, queries * mlp_hidden_.out);
      mlp_hidden_.apply_gelu(pooled, queries, hidden);
      // The last layer is linear, so it is applied to the mean over the queries.
      Numbers mean(static_cast<size_t>(num_features() * mlp_hidden_.out)), added(static_cast<size_t>(camera_width()));
      average_queries(hidden, mlp_hidden_.out, mean.data());
      mlp_out_.apply(mean.data(), num_features(), added.data());
      for (int64_t c = 0; c < camera_width(); ++c) to[c] += added[c];
    }
    // Concatenated features are the parts of a mean.
    for (int64_t c = 0; c < camera_width(); ++c) to[c] /= static_cast<float>(num_features());
  }

  static void softmax_over_rows(float* scores, int64_t rows, int64_t columns) {
    for (int64_t c = 0; c < columns; ++c) {
      float largest = scores[c], sum = 0;
      for (int64_t r = 1; r < rows; ++r) largest = std::max(largest, scores[r * columns + c]);
      for (int64_t r = 0; r < rows; ++r) {
        float& score = scores[r * columns + c];
        score = std::exp(score - largest);
        sum += score;
      }
      for (int64_t r = 0; r < rows; ++r) scores[r * columns + c] /= sum;
    }
  }

  int64_t num_features() const { return num_camera_features(config_); }
  int64_t camera_width() const { return num_features() * width_; }

  // Averages the rows of the queries that form one feature, for each feature.
  void average_queries(const float* x, int64_t columns, float* to) const {
    const int64_t rows = config_.num_queries / num_features();
    std::fill_n(to, num_features() * columns, 0.0f);
    for (int64_t feature = 0; feature < num_features(); ++feature, to += columns) {
      for (int64_t r = 0; r < rows; ++r, x += columns) {
        for (int64_t c = 0; c < columns; ++c) to[c] += x[c];
      }
      for (int64_t c = 0; c < columns; ++c) to[c] /= static_cast<float>(rows);
    }
  }

  const PolicySection config_;
  const int64_t num_cameras_, width_;  // channels of a token
  const int patch_px_;
  std::vector<Dense> convolutions_;  // inputs: [kernel, kernel, in]
  Norm token_norm_, mlp_norm_;
  Dense position_, attended_, mlp_hidden_, mlp_out_, project_;
  Numbers queries_;  // [cameras, queries, width_]
  Numbers asked_;    // [cameras, width_, queries * heads]
  std::vector<Scratch> scratch_;
};

}  // namespace

struct HostNetwork::Parts {
  Parts(const StoredPolicy& saved, int num_cameras) : config(saved.config) {
    PICTURA_CHECK(saved.backbone_hash.empty() && config.policy.backbone == "conv",
                  "{}: policy.backbone: its policy has the program {} in place of convolutions, which needs torch",
                  saved.path, config.policy.backbone);
    check_finite(saved.path, saved.parameters);
    ParameterReader read(saved);
    const PolicySection& policy = config.policy;
    if (config.reads_images())
      images = std::make_unique<ImageEncoder>(policy, num_cameras, &read);
    else
      sets = std::make_unique<SetEncoder>(config, &read);
    waypoint_features = row_features_of(policy, "waypoints");
    ego = read.group("ego", num_ego_features(config.reads_images()), policy);
    conditioning = read.group(
        "conditioning", kNumConditioning + kNumWaypoints * (kWaypointFeatures + waypoint_features.count()), policy);
    const int64_t inside = policy.backbone_width;
    in_width = (images ? images->width() : sets->width()) + 2 * int64_t{policy.embedding_width};
    for (int i = 0; i < policy.backbone_layers; ++i) {
      trunk.push_back(read.linear(fmt::format("backbone.{}", i), i == 0 ? in_width : inside, inside));
    }
    actor = read.linear("actor", inside, kNumActions);
    critic = read.linear("critic", inside, 1);
    read.finish();
  }

  // Encodes the ego features, and conditioning with waypoints, of agents [begin, begin + count). Writes to columns [at,
  // in_width) of `to`.
  void encode_own(const ObservationView& arrays, int64_t begin, int64_t count, int64_t at, float* to) const {
    const int64_t ego_width = ego.hidden.in;
    Numbers egos, own;
    for (int64_t i = begin; i < begin + count; ++i) {
      const float* const its_ego = arrays.ego.data() + i * kEgoFeatures;
      egos.insert(egos.end(), its_ego, its_ego + ego_width);
      const float* const its_conditioning = arrays.conditioning.data() + i * kNumConditioning;
      own.insert(own.end(), its_conditioning, its_conditioning + kNumConditioning);
      const float* const waypoints = arrays.waypoints.data() + i * kNumWaypoints * kWaypointFeatures;
      own.insert(own.end(), waypoints, waypoints + kNumWaypoints * kWaypointFeatures);
      for (int w = 0; w < kNumWaypoints; ++w) {
        for (int f = 0; f < waypoint_features.count(); ++f) {
          own.push_back(row_feature(waypoint_features, waypoints + w * kWaypointFeatures, f));
        }
      }
    }
    const int64_t width = config.policy.embedding_width;
    const Numbers encoded[] = {ego.encode(egos.data(), count), conditioning.encode(own.data(), count)};
    for (int64_t i = 0; i < count; ++i) {
      for (int64_t part = 0; part < 2; ++part) {
        std::copy_n(encoded[part].data() + i * width, width, to + i * in_width + at + part * width);
      }
    }
  }

  // Runs the trunk. x: [count, in_width]. Returns [count, backbone_width].
  Numbers run_trunk(Numbers x, int64_t count) const {
    const Norm plain;
    for (size_t i = 0; i < trunk.size(); ++i) {
      Numbers normalized = x, y(static_cast<size_t>(count * trunk[i].out));
      if (config.policy.layer_norm && i > 0) plain.apply(normalized.data(), count, trunk[i].in);
      trunk[i].apply_gelu(normalized.data(), count, y.data());
      if (config.policy.residual && i > 0) std::transform(y.begin(), y.end(), x.begin(), y.begin(), std::plus<>());
      x = std::move(y);
    }
    if (config.policy.layer_norm) plain.apply(x.data(), count, config.policy.backbone_width);
    return x;
  }

  // Computes the outputs of agents [begin, begin + count). `pooled` is the result of ImageEncoder::pool() for all
  // agents.
  void forward(const ObservationView& arrays, const Numbers& pooled, int64_t begin, int64_t count, float* logits_out,
               float* values_out) const {
    const int64_t scene_width = images ? images->width() : sets->width();
    Numbers scene(static_cast<size_t>(count * scene_width)), x(static_cast<size_t>(count * in_width));
    if (images)
      images->encode(pooled.data() + begin * images->pooled_width(), count, scene.data());
    else
      sets->encode(arrays, begin, count, scene.data());
    for (int64_t i = 0; i < count; ++i) {
      std::copy_n(scene.data() + i * scene_width, scene_width, x.data() + i * in_width);
    }
    encode_own(arrays, begin, count, scene_width, x.data());
    const Numbers features = run_trunk(std::move(x), count);
    actor.apply(features.data(), count, logits_out + begin * kNumActions);
    critic.apply(features.data(), count, values_out + begin);
  }

  const Config config;
  std::unique_ptr<ImageEncoder> images;  // null for a vector policy; otherwise `sets` is null
  std::unique_ptr<SetEncoder> sets;
  RowFeatures waypoint_features;
  Group ego, conditioning;
  std::vector<Dense> trunk;
  Dense actor, critic;
  int64_t in_width = 0;  // input width of the trunk
};

HostNetwork::HostNetwork(const StoredPolicy& saved, int num_cameras)
    : parts_(std::make_unique<Parts>(saved, num_cameras)) {}

HostNetwork::~HostNetwork() = default;

void HostNetwork::forward(const HostObservation& observation, int num_threads, float* logits_out,
                          float* values_out) const {
  constexpr int64_t kAgentsAtOnce = 16;  // activations of this number of agents fit a core's cache
  const Numbers pooled = parts_->images ? parts_->images->pool(observation, num_threads) : Numbers();
  parallel_for(num_threads, (observation.agents + kAgentsAtOnce - 1) / kAgentsAtOnce, [&](int64_t block) {
    const int64_t begin = block * kAgentsAtOnce, count = std::min(kAgentsAtOnce, observation.agents - begin);
    parts_->forward(observation.arrays, pooled, begin, count, logits_out, values_out);
  });
}

}  // namespace pictura
