// Section [policy] of a configuration.
#pragma once

#include <string>
#include <vector>

namespace pictura {

enum class Modality { perspective, vector };

constexpr int kMaxPatch_px = 16;

constexpr int kMaxDecisionSteps = 1000;

struct PolicySection {
  Modality modality = Modality::perspective;
  // Vector modality: also observes values that no camera could observe, as the paper's policy Vectorized does.
  bool auxiliary = false;
  // Space to depth: each patch of pixels becomes one pixel with all channels.
  int patch_px = 4;
  static constexpr int kMaxConvChannels = 4096;
  std::vector<int> conv_channels{64, 64, 128, 128, 128};
  std::vector<int> conv_kernels{1, 3, 3, 3, 3};
  std::vector<int> conv_strides{1, 1, 2, 1, 1};
  int num_queries = 16;              // learned queries per camera
  bool concatenate_queries = false;  // false: the features of a camera are the mean over its queries
  int attention_heads = 4;
  int attention_mlp = 256;   // hidden width of the MLP; 0: no MLP
  int embedding_width = 64;  // per group of observations
  // Features that resolve positions near the agent, see policy/row_features.h.
  bool point_features = true;
  // Vector modality: position relative to lanes, boundaries and walls.
  bool segment_features = false;
  /// "conv", or the path of a network exported by scripts/export_backbone, relative to the configuration's folder.
  std::string backbone = "conv";
  bool backbone_frozen = true;  // keeps the backbone's weights fixed
  int backbone_layers = 4, backbone_width = 512;
  bool layer_norm = false;  // see docs/explanation/network.md
  bool conv_norm = false;   // layer norms without parameters between convolutions and their GELU
  bool residual = false;    // every trunk layer except the first adds its input
  int decision_steps = 1;   // see policy/decision_clock.h
};

}  // namespace pictura
