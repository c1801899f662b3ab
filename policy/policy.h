// The two policies of the paper (appendix, table of the policy architecture): one trunk with actor and critic, behind
// either encoders of four entity sets, or five with walls, or one image branch as wide as four. Plain tensors and
// functions, no torch modules.
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

/// A parameter by the name under which it is saved.
struct NamedTensor {
  std::string name;
  at::Tensor value;
};

/// 16 hexadecimal digits over the parameters' bytes, in their order.
std::string hash_of_parameters(const std::vector<NamedTensor>& parameters);

class ImageBackbone;

/// Turns what is around an agent into one embedding.
class SceneEncoder {
 public:
  virtual ~SceneEncoder() = default;
  virtual at::Tensor forward(const Observation& observation) const = 0;
  /// Of the embedding.
  virtual int64_t width() const = 0;
  /// The program in the place of its convolutions, or null.
  virtual const ImageBackbone* image_backbone() const { return nullptr; }
  /// See Policy::drawn_patch_px.
  virtual int drawn_patch_px() const { return 0; }
};

/// What learning asks of a policy.
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
  /// Of parameters(), as hash_of_parameters says.
  std::string hash() const;
  /// Of the file of policy.backbone; empty where that is "conv" and for vector policies.
  virtual std::string backbone_hash() const { return ""; }
  /// Throws Error naming camera and file where the program of policy.backbone does not take such images.
  virtual void check_images(const Rig& /*rig*/) const {}
  /// Side of the patches as which it also reads images (ImageBlock), 0: it reads planar images alone. Its first
  /// convolution takes such patches, so that nothing is left to do between drawing and that.
  virtual int drawn_patch_px() const { return 0; }

 protected:
  std::vector<NamedTensor> parameters_;
};

/// The paper's.
class PolicyNetwork final : public Policy {
 public:
  /// Parameters are drawn from (seed, index of the parameter, index of the element) alone, but for those of a program
  /// (policy.backbone), which begin as they are in its file. With `reads_walls` the
  /// vector policy has a fifth set. The host has bf16 too, slowly, but no tf32: there it is fp32.
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
  int64_t ego_features_;  // the image branch comes without the auxiliary slots
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
  bool layer_norm_, residual_;  // of the trunk
  std::vector<Linear> backbone_;
  Linear actor_, critic_;

  friend class ParameterMaker;
  friend class VectorEncoder;
  friend class PerspectiveEncoder;
};

/// The policy of a configuration, for cameras of this rig. The host computes in fp32. Throws Error naming the file
/// where policy.backbone names one that cannot serve.
std::unique_ptr<const Policy> make_policy(const Config& config, const Rig& rig, Device device);

/// Multiplies the logits by a factor, in the parameters of the layer they come from.
void scale_logits(const Policy& policy, double factor);

/// Policy outputs for a whole batch without gradients: logits and log-probabilities [batch, actions], values [batch].
struct Decision {
  at::Tensor logits, log_probs, value;

  /// Whether all logits and values are finite numbers: bool, where they are.
  at::Tensor are_finite() const;
  /// The same. Waits for the device.
  bool is_finite() const { return are_finite().item<bool>(); }
};
/// For the agents in some rows, i64 [batch], a chunk at a time: act(rows) gives what the policy makes of those of a
/// chunk, which need not outlast the next call.
Decision decide(const at::Tensor& rows, const ChunkSizes& chunks,
                const std::function<Policy::Output(const at::Tensor& rows)>& act);

/// Largest value over the members of each set, [batch, members, width] -> [batch, width]; members at and beyond
/// counts [batch] are padding; an empty set gives zeros.
at::Tensor masked_max(const at::Tensor& members, const at::Tensor& counts);

}  // namespace pictura
