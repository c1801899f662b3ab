// Section [render] of a configuration: images of a policy.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

struct RenderSection {
  std::string backend = "auto";       // a renderer's name for make_renderer()
  PixelSamples samples;               // samples per pixel for the renderer gl; other renderers compute exact coverage
  std::string rig;                    // path of a rig file (docs/explanation/image.md)
  int width_px = 96, height_px = 54;  // image size of each camera of the paper's rig; unused with a rig file
  /// Change of the image size after agent_steps agent-steps of the run. If patch_px is not 0, policy.patch_px and
  /// line_floor_px change too, and the first convolution is spread over the larger patches (policy/patch_spread.h).
  struct SizeChange {
    int64_t agent_steps = 0;
    int width_px = 0, height_px = 0;
    int patch_px = 0;  // 0: patch_px and line_floor_px do not change
    double line_floor_px = 0;
    bool has_patches() const { return patch_px > 0; }
  };
  // In ascending order of agent_steps; must be empty with a rig file.
  std::vector<SizeChange> schedule;
  double line_floor_px = 0.35;        // minimum width of a line on screen
  CameraRandomization randomization;  // randomization of cameras in training; its seed is run.seed
};

}  // namespace pictura
