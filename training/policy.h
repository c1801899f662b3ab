// The two policies of the paper (appendix, table of the policy architecture): one trunk with actor and critic, behind
// either four entity-set encoders or one image branch of the same width. Plain tensors and functions: ATen alone.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/training/config.h"

namespace pictura {

/// The images of the cameras that share one size.
struct ImageBlock {
  at::Tensor pixels;             // u8 [batch, cameras of this size, 3, height, width]
  std::vector<int64_t> cameras;  // their indices in the rig
};

/// What a batch of agents sees. Tensors that the modality does not use are undefined.
struct Observation {
  at::Tensor ego;                                    // [batch, kEgoFeatures]
  at::Tensor conditioning;                           // [batch, kNumConditioning]
  at::Tensor waypoints;                              // [batch, kNumWaypoints * kWaypointFeatures]
  at::Tensor partners, lanes, boundaries, controls;  // [batch, members, features]
  at::Tensor set_counts;                             // i32 [batch, kNumEntitySets]
  std::vector<ImageBlock> images;

  /// Applies f to every defined tensor.
  template <typename F>
  Observation map(F&& f) const {
    Observation result;
    at::Tensor Observation::* const tensors[] = {
        &Observation::ego,   &Observation::conditioning, &Observation::waypoints, &Observation::partners,
        &Observation::lanes, &Observation::boundaries,   &Observation::controls,  &Observation::set_counts};
    for (const auto tensor : tensors) {
      if ((this->*tensor).defined()) result.*tensor = f(this->*tensor);
    }
    for (const ImageBlock& block : images) result.images.push_back({f(block.pixels), block.cameras});
    return result;
  }
};

/// A parameter by the name under which it is saved.
struct NamedTensor {
  std::string name;
  at::Tensor value;
};

/// Turns what stands around an agent into one embedding of 4 * policy.embedding_width.
class SceneEncoder {
 public:
  virtual ~SceneEncoder() = default;
  virtual at::Tensor forward(const Observation& observation) const = 0;
};

class Policy {
 public:
  /// Parameters are drawn from (seed, index of the parameter, index of the element) alone.
  Policy(const Config::PolicySection& config, int num_cameras, uint64_t seed, at::ScalarType type = at::kFloat);

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

/// Largest value over the members of each set, [batch, members, width] -> [batch, width]; members at and beyond
/// counts [batch] are padding; an empty set gives zeros.
at::Tensor masked_max(const at::Tensor& members, const at::Tensor& counts);

}  // namespace pictura
