// Section [render] of a configuration: images of a policy.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

struct RenderSection {
  std::string backend = "auto";       // as make_renderer() takes it
  PixelSamples samples;               // samples of gl; other renderers compute exact coverage
  std::string rig;                    // path of a rig file (docs/explanation/image.md)
  int width_px = 96, height_px = 54;  // without a rig file: size of each camera of the paper's rig
  /// Image size from a number of agent-steps of the run on, in ascending order; not with a rig file. If patch_px is not
  /// 0, policy.patch_px and line_floor_px take these values from then on, and the first convolution is spread over the
  /// larger patches (policy/patch_spread.h).
  struct SizeChange {
    int64_t agent_steps = 0;
    int width_px = 0, height_px = 0;
    int patch_px = 0;  // 0: patches and line floor remain
    double line_floor_px = 0;
    bool has_patches() const { return patch_px > 0; }
  };
  std::vector<SizeChange> schedule;
  double line_floor_px = 0.35;        // minimum width of a line on screen
  CameraRandomization randomization;  // in training; its seed is run.seed
};

}  // namespace pictura
