// Section [policy] of a configuration: inputs and network of a policy.
#pragma once

#include <string>
#include <vector>

namespace pictura {

enum class Modality { perspective, vector };

/// Maximum side of a policy's patches in a configuration.
constexpr int kMaxPatch_px = 16;

constexpr int kMaxDecisionSteps = 1000;

struct PolicySection {
  Modality modality = Modality::perspective;
  bool auxiliary = false;  // vector: fill the slots that no camera could observe (the paper's Vectorized)
  int patch_px = 4;        // space to depth: each patch of patch_px^2 pixels becomes one pixel with all its channels
  std::vector<int> conv_channels{64, 64, 128, 128, 128};
  std::vector<int> conv_kernels{1, 3, 3, 3, 3};
  std::vector<int> conv_strides{1, 1, 2, 1, 1};
  int num_queries = 16;  // learned queries per camera
  int attention_heads = 4;
  int attention_mlp = 256;     // hidden width of the block's MLP; 0: none
  int embedding_width = 64;    // width of every group
  bool point_features = true;  // encoders read features that resolve points near the agent, see policy/row_features.h
  bool segment_features = false;  // vector: encoders read the agent's position relative to lanes, boundaries and walls
  /// "conv" for the convolutions, or the path of a program of scripts/export_backbone, relative to the configuration's
  /// folder.
  std::string backbone = "conv";
  bool backbone_frozen = true;  // keeps the program's weights fixed
  int backbone_layers = 4, backbone_width = 512;
  bool layer_norm = false;  // normalizes the layers of groups and trunk, see docs/explanation/network.md
  bool residual = false;    // every trunk layer except the first adds its input
  int decision_steps = 1;   // steps for which an action is held, at most kMaxDecisionSteps, see policy/decision_clock.h
};

}  // namespace pictura
