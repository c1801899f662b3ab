// The paper's two policies (appendix, table of the policy architecture). Both have the same trunk with actor and
// critic. Before the trunk, the vector policy has encoders of four entity sets (five with walls). The image policy
// instead has an image encoder whose output is as wide as those of the four encoders together. The code uses tensors
// and functions, but no torch modules.
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

/// Parameter with the name under which it is saved.
struct NamedTensor {
  std::string name;
  at::Tensor value;
};

/// Returns the hash of the parameters' bytes in their order: 16 hexadecimal digits.
std::string hash_of_parameters(const std::vector<NamedTensor>& parameters);

class ImageBackbone;

/// Network that encodes the surroundings of each agent as one embedding.
class SceneEncoder {
 public:
  virtual ~SceneEncoder() = default;
  virtual at::Tensor forward(const Observation& observation) const = 0;
  /// Width of the embedding.
  virtual int64_t width() const = 0;
  /// Pretrained program that replaces the convolutions, or null.
  virtual const ImageBackbone* image_backbone() const { return nullptr; }
  /// See Policy::drawn_patch_px.
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
  };
  virtual Output forward(const Observation& observation) const = 0;

  const std::vector<NamedTensor>& parameters() const { return parameters_; }
  int64_t num_parameters() const;
  /// Hash of parameters(), see hash_of_parameters().
  std::string hash() const;
  /// Hash of the file policy.backbone; empty for vector policies and if policy.backbone is "conv".
  virtual std::string backbone_hash() const { return ""; }
  /// Throws Error, which names camera and file, if the program policy.backbone does not support the images of the rig.
  virtual void check_images(const Rig& /*rig*/) const {}
  /// Side in px of the image patches that the policy can read (ImageBlock); 0 if it reads only planar images. If the
  /// renderer draws such patches, images need no conversion before the first convolution.
  virtual int drawn_patch_px() const { return 0; }

 protected:
  std::vector<NamedTensor> parameters_;
};

/// The paper's actor-critic network.
class PolicyNetwork final : public Policy {
 public:
  /// Initializes parameters with random numbers that depend only on seed, index of the parameter and index of the
  /// element. Parameters of a program (policy.backbone) are read from its file instead. With `reads_walls`, a vector
  /// policy encodes walls too. The host supports bf16, but slowly; for tf32 it computes in fp32.
  PolicyNetwork(const PolicySection& config, int num_cameras, uint64_t seed, at::ScalarType type = at::kFloat,
                bool reads_walls = false, Device device = {}, Precision precision = Precision::fp32);

  Output forward(const Observation& observation) const override;
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

/// Creates the policy of a configuration, for the cameras of a rig. The host computes in fp32. Throws Error, which
/// names the file, if the program policy.backbone cannot be used.
std::unique_ptr<const Policy> make_policy(const Config& config, const Rig& rig, Device device);

/// Multiplies the policy's logits by a factor: scales the parameters of the layer that computes the logits.
void scale_logits(const Policy& policy, double factor);

/// Outputs of a policy for a batch, without gradients: logits and log-probabilities [batch, actions], values [batch].
struct Decision {
  at::Tensor logits, log_probs, value;

  /// Returns whether all logits and values are finite, as a bool tensor on their device.
  at::Tensor are_finite() const;
  /// Whether all logits and values are finite. Waits for the device.
  bool is_finite() const { return are_finite().item<bool>(); }
};
/// Runs the policy, chunk by chunk, for the agents with row numbers `rows`, i64 [batch]. act(rows) must return the
/// policy's output for the rows of a chunk. Each output of act() may become invalid at the next call of act().
Decision decide(const at::Tensor& rows, const ChunkSizes& chunks,
                const std::function<Policy::Output(const at::Tensor& rows)>& act);

/// Returns the largest value of each channel over the members of each set: [batch, members, width] -> [batch, width].
/// Members from index counts[i] on are padding; counts: [batch]. An empty set gives zeros.
at::Tensor masked_max(const at::Tensor& members, const at::Tensor& counts);

}  // namespace pictura
