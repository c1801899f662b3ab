// The paper's vector and image policies (appendix, table of the policy architecture). Both have the same trunk, actor
// and critic. The image encoder's output is as wide as that of the vector policy's entity set encoders.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/configuration/config.h"
#include "pictura/policy/chunks.h"
#include "pictura/policy/observation.h"
#include "pictura/policy/rules/network_passes.h"

namespace pictura {

/// Parameter with its name in files.
struct NamedTensor {
  std::string name;
  at::Tensor value;
};

/// Returns 16 hexadecimal digits.
std::string hash_of_parameters(const std::vector<NamedTensor>& parameters);

class ImageBackbone;

/// Encoder of an agent's surroundings as one embedding.
class SceneEncoder {
 public:
  virtual ~SceneEncoder() = default;
  virtual at::Tensor forward(const Observation& observation) const = 0;
  virtual int64_t width() const = 0;
  /// Program that replaces the convolutions, or null.
  virtual const ImageBackbone* image_backbone() const { return nullptr; }
  /// See Policy::drawn_patch_px().
  virtual int drawn_patch_px() const { return 0; }
};

/// Interface of policies for learning.
class Policy {
 public:
  Policy() = default;
  virtual ~Policy() = default;
  Policy(const Policy&) = delete;
  Policy& operator=(const Policy&) = delete;

  struct Output {
    at::Tensor logits;  // [batch, kNumActions]
    at::Tensor value;   // [batch], in units of the reward
    at::Tensor scene;   // [batch, scene_width()], output of the scene encoder in the type of its computation
  };
  virtual Output forward(const Observation& observation) const = 0;

  const std::vector<NamedTensor>& parameters() const { return parameters_; }
  /// Returns the parameters behind the scene encoder, whose names do not depend on policy.modality.
  std::vector<NamedTensor> trunk_parameters() const {
    return {parameters_.begin() + num_scene_parameters_, parameters_.end()};
  }
  /// 0: the policy has no scene encoder, and Output::scene is undefined.
  virtual int64_t scene_width() const { return 0; }
  int64_t num_parameters() const;
  std::string hash() const;
  /// Hash of the program policy.backbone; empty without one.
  virtual std::string backbone_hash() const { return ""; }
  /// Throws Error naming camera and file if the program policy.backbone does not support an image size.
  virtual void check_images(const Rig& /*rig*/) const {}
  /// Side in px of image patches (ImageBlock) that the policy reads without conversion; 0: none.
  virtual int drawn_patch_px() const { return 0; }

 protected:
  std::vector<NamedTensor> parameters_;
  ptrdiff_t num_scene_parameters_ = 0;  // the scene encoder's parameters come first
};

/// The paper's actor-critic network.
class PolicyNetwork final : public Policy {
 public:
  /// Draws parameters that depend only on seed, parameter index and element index. Parameters of a program
  /// (policy.backbone) come from its file. reads_walls: a vector policy encodes walls too. On the host, bf16 is slow,
  /// and fp32 replaces tf32.
  PolicyNetwork(const PolicySection& config, int num_cameras, uint64_t seed, at::ScalarType type = at::kFloat,
                bool reads_walls = false, Device device = {}, Precision precision = Precision::fp32);

  Output forward(const Observation& observation) const override;
  int64_t scene_width() const override { return scene_->width(); }
  std::string backbone_hash() const override;
  void check_images(const Rig& rig) const override;
  int drawn_patch_px() const override;

 private:
  std::unique_ptr<SceneEncoder> scene_;
  at::ScalarType type_;
  Precision precision_;
  int64_t ego_features_;  // see num_ego_features()
  RowFeatures waypoint_features_;

  struct Linear {
    at::Tensor weight, bias;
  };
  struct GroupEncoder {
    Linear hidden, out;
    bool layer_norm = false;
  };
  at::Tensor run_trunk(at::Tensor x) const;

  GroupEncoder ego_, conditioning_;
  bool layer_norm_, residual_;  // options of the trunk's layers
  std::vector<Linear> backbone_;
  Linear actor_, critic_;

  friend class ParameterMaker;
  friend class VectorEncoder;
  friend class PerspectiveEncoder;
};

/// Creates a configuration's policy for a rig. The host computes in fp32. Throws Error naming the file if the program
/// policy.backbone cannot be used.
std::unique_ptr<const Policy> make_policy(const Config& config, const Rig& rig, Device device);

/// Multiplies the policy's logits by a factor.
void scale_logits(const Policy& policy, double factor);

/// Outputs for a batch, without gradients: logits and log-probabilities [batch, actions], values [batch].
struct Decision {
  at::Tensor logits, log_probs, value;
  at::Tensor scene;  // f32 [batch, scene_width]; undefined unless requested

  /// Whether all logits and values are finite, as a bool tensor.
  at::Tensor are_finite() const;
  /// Waits for the device.
  bool is_finite() const { return are_finite().item<bool>(); }
};
/// Runs the policy chunk by chunk for `rows`, i64 [batch]. act(rows) returns the output for a chunk's rows, valid until
/// its next call. A scene_width other than 0, the policy's, requests scene embeddings.
Decision decide(const at::Tensor& rows, const ChunkSizes& chunks,
                const std::function<Policy::Output(const at::Tensor& rows)>& act, int64_t scene_width = 0);

/// Returns each channel's largest value in a set: [batch, members, width] -> [batch, width]; 0 for an empty set.
/// Members from index counts[i] on are padding; counts: [batch].
at::Tensor masked_max(const at::Tensor& members, const at::Tensor& counts);

}  // namespace pictura
