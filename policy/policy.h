// The paper's two policies (appendix, table of the policy architecture). Both have the same trunk with actor and
// critic. Before the trunk, the vector policy has encoders of four entity sets (five with walls), and the image policy
// has one image branch as wide as the four encoders. Plain tensors and functions, no torch modules.
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

/// Hash of the parameters' bytes in their order: 16 hexadecimal digits.
std::string hash_of_parameters(const std::vector<NamedTensor>& parameters);

class ImageBackbone;

/// Encodes the surroundings of an agent into one embedding.
class SceneEncoder {
 public:
  virtual ~SceneEncoder() = default;
  virtual at::Tensor forward(const Observation& observation) const = 0;
  /// Width of the embedding.
  virtual int64_t width() const = 0;
  /// Program that replaces the convolutions, or null.
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
    at::Tensor value;   // [batch], in units of rewards
  };
  virtual Output forward(const Observation& observation) const = 0;

  const std::vector<NamedTensor>& parameters() const { return parameters_; }
  int64_t num_parameters() const;
  /// Hash of parameters(), see hash_of_parameters().
  std::string hash() const;
  /// Hash of the file of policy.backbone; empty if policy.backbone is "conv", and for vector policies.
  virtual std::string backbone_hash() const { return ""; }
  /// Throws Error naming camera and file if the program of policy.backbone does not support these images.
  virtual void check_images(const Rig& /*rig*/) const {}
  /// Side in px of the patches in which the policy can read images (ImageBlock); 0 if it reads planar images only. The
  /// first convolution reads such patches directly, so that no conversion follows drawing.
  virtual int drawn_patch_px() const { return 0; }

 protected:
  std::vector<NamedTensor> parameters_;
};

/// The paper's actor-critic network.
class PolicyNetwork final : public Policy {
 public:
  /// Draws parameters, each keyed only by (seed, index of the parameter, index of the element). Parameters of a program
  /// (policy.backbone) start from the program's file instead. With `reads_walls` the vector policy has a fifth set. The
  /// host supports bf16, slowly; for tf32 it computes in fp32.
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
  int64_t ego_features_;  // the image branch lacks the auxiliary slots
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

/// Creates the policy of a configuration, for the cameras of a rig. The host computes in fp32. Throws Error naming the
/// file if the program of policy.backbone cannot be used.
std::unique_ptr<const Policy> make_policy(const Config& config, const Rig& rig, Device device);

/// Multiplies the policy's logits by a factor, by scaling the parameters of the layer that computes them.
void scale_logits(const Policy& policy, double factor);

/// Policy outputs for a whole batch without gradients: logits and log-probabilities [batch, actions], values [batch].
struct Decision {
  at::Tensor logits, log_probs, value;

  /// Returns whether all logits and values are finite, as a bool tensor in their memory.
  at::Tensor are_finite() const;
  /// Whether all logits and values are finite. Waits for the device.
  bool is_finite() const { return are_finite().item<bool>(); }
};
/// Runs the policy for the agents of `rows`, i64 [batch], chunk by chunk. act(rows) returns the policy's output for a
/// chunk's rows; the output need not outlast the next call.
Decision decide(const at::Tensor& rows, const ChunkSizes& chunks,
                const std::function<Policy::Output(const at::Tensor& rows)>& act);

/// Returns the largest value of each channel over the members of each set: [batch, members, width] -> [batch, width].
/// Members from index counts[i] on are padding; counts: [batch]. An empty set gives zeros.
at::Tensor masked_max(const at::Tensor& members, const at::Tensor& counts);

}  // namespace pictura
