// Section [policy] of a configuration: inputs and network of a policy.
#pragma once

#include <string>
#include <vector>

namespace pictura {

enum class Modality { perspective, vector };

/// Maximum side of a policy's patches (PolicySection::patch_px).
constexpr int kMaxPatch_px = 16;

constexpr int kMaxDecisionSteps = 1000;

struct PolicySection {
  Modality modality = Modality::perspective;
  // Only for the vector modality: also observes values that no camera could observe (the paper's policy named
  // Vectorized).
  bool auxiliary = false;
  // Space to depth: each patch of patch_px x patch_px pixels becomes one pixel with the channels of all its pixels.
  int patch_px = 4;
  std::vector<int> conv_channels{64, 64, 128, 128, 128};
  std::vector<int> conv_kernels{1, 3, 3, 3, 3};
  std::vector<int> conv_strides{1, 1, 2, 1, 1};
  int num_queries = 16;  // learned queries per camera
  int attention_heads = 4;
  int attention_mlp = 256;   // hidden width of the attention block's MLP; 0: no MLP
  int embedding_width = 64;  // embedding width of each group of observations
  // Encoders read additional features, which resolve positions near the agent; see policy/row_features.h.
  bool point_features = true;
  // Only for the vector modality: encoders read the agent's position relative to lanes, boundaries and walls.
  bool segment_features = false;
  /// "conv" for the convolutions above, or the path of a network that scripts/export_backbone exported. The path is
  /// relative to the configuration's folder.
  std::string backbone = "conv";
  bool backbone_frozen = true;  // keeps the weights of the exported network fixed
  int backbone_layers = 4, backbone_width = 512;
  bool layer_norm = false;  // normalizes layers, see docs/explanation/network.md
  bool residual = false;    // every trunk layer except the first adds its input
  int decision_steps = 1;   // steps for which an action is held, see policy/decision_clock.h
};

}  // namespace pictura
