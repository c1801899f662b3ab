// [policy] of a configuration: what a policy reads and its network.
#pragma once

#include <string>
#include <vector>

namespace pictura {

enum class Modality { perspective, vector };

/// Largest side of a policy's patches that a configuration may have.
constexpr int kMaxPatch_px = 16;

constexpr int kMaxDecisionSteps = 1000;

struct PolicySection {
  Modality modality = Modality::perspective;
  bool auxiliary = false;  // vector: fill the slots that no camera could (the paper's Vectorized)
  int patch_px = 4;        // space to depth: a patch of so many pixels squared becomes one with as many channels
  std::vector<int> conv_channels{64, 64, 128, 128, 128};
  std::vector<int> conv_kernels{1, 3, 3, 3, 3};
  std::vector<int> conv_strides{1, 1, 2, 1, 1};
  int num_queries = 16;  // learned queries per camera
  int attention_heads = 4;
  int attention_mlp = 256;        // hidden width of the block's MLP; 0: none
  int embedding_width = 64;       // of every group
  bool point_features = true;     // encoders read points near the agent apart, see policy/row_features.h
  bool segment_features = false;  // vector: encoders read the agent's place beside lanes, boundaries and walls
  /// "conv": the convolutions; or the path of a program of scripts/export_backbone, relative to the configuration's
  /// folder.
  std::string backbone = "conv";
  bool backbone_frozen = true;  // the program's weights stay as they are
  int backbone_layers = 4, backbone_width = 512;
  bool layer_norm = false;  // layers of groups and trunk are normalized, see docs/explanation/network.md
  bool residual = false;    // every layer of the trunk but the first adds its input
  int decision_steps = 1;   // steps for which an action is held, at most kMaxDecisionSteps, see policy/decision_clock.h
};

}  // namespace pictura
