// The two policies of the paper (appendix, table of the policy architecture): one trunk with actor and critic, behind
// either encoders of four entity sets, or five with walls, or one image branch as wide as four. Plain tensors and
// functions: ATen alone.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/training/config.h"
#include "pictura/training/observation.h"

namespace pictura {

/// A parameter by the name under which it is saved.
struct NamedTensor {
  std::string name;
  at::Tensor value;
};

/// Turns what is around an agent into one embedding.
class SceneEncoder {
 public:
  virtual ~SceneEncoder() = default;
  virtual at::Tensor forward(const Observation& observation) const = 0;
  /// Of the embedding.
  virtual int64_t width() const = 0;
};

class Policy {
 public:
  /// Parameters are drawn from (seed, index of the parameter, index of the element) alone. With `reads_walls` the
  /// vector policy has a fifth set.
  Policy(const Config::PolicySection& config, int num_cameras, uint64_t seed, at::ScalarType type = at::kFloat,
         bool reads_walls = false);

  struct Output {
    at::Tensor logits;  // [batch, kNumActions]
    at::Tensor value;   // [batch]
  };
  Output forward(const Observation& observation) const;

  const std::vector<NamedTensor>& parameters() const { return parameters_; }
  int64_t num_parameters() const;
  /// 16 hexadecimal digits over the parameters' bytes, in the order of parameters().
  std::string hash() const;

 private:
  std::vector<NamedTensor> parameters_;
  std::unique_ptr<SceneEncoder> scene_;
  at::ScalarType type_;
  int64_t ego_features_;  // the image branch comes without the auxiliary slots

  struct Linear {
    at::Tensor weight, bias;
  };
  struct GroupEncoder {
    Linear hidden, out;
  };
  GroupEncoder ego_, conditioning_;
  std::vector<Linear> backbone_;
  Linear actor_, critic_;

  friend class ParameterMaker;
  friend class VectorEncoder;
  friend class PerspectiveEncoder;
};

/// The policy of a configuration, for cameras of this rig.
Policy make_policy(const Config& config, const Rig& rig);

/// Policy outputs for a whole batch without gradients, `chunk` agents at a time: logits and log-probabilities
/// [batch, actions], and values [batch].
struct Decision {
  at::Tensor logits, log_probs, value;
};
Decision decide(const Policy& policy, const Observation& observation, int64_t chunk);

/// Chooses one action per slot: the most likely one, or a draw keyed by (seed, global world, agent, episode, step).
void choose_actions(const at::Tensor& log_probs, const ControllerInput& input, uint64_t seed, bool argmax,
                    Span<int32_t> actions_out);

/// Largest value over the members of each set, [batch, members, width] -> [batch, width]; members at and beyond
/// counts [batch] are padding; an empty set gives zeros.
at::Tensor masked_max(const at::Tensor& members, const at::Tensor& counts);

}  // namespace pictura
