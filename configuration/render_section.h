// Section [render] of a configuration.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

struct RenderSection {
  std::string backend = "auto";       // name for make_renderer()
  PixelSamples samples;               // only for the renderer gl
  std::string rig;                    // path of a rig file
  int width_px = 96, height_px = 54;  // size of each image of the paper's rig; unused with a rig file
  /// Change of the image size after agent_steps agent-steps. If patch_px is not 0, policy.patch_px and line_floor_px
  /// also change (policy/patch_spread.h).
  struct SizeChange {
    int64_t agent_steps = 0;
    int width_px = 0, height_px = 0;
    int patch_px = 0;  // 0: no change
    double line_floor_px = 0;
    bool has_patches() const { return patch_px > 0; }
  };
  // Ascending in agent_steps; empty with a rig file.
  std::vector<SizeChange> schedule;
  double line_floor_px = 0.35;        // minimum width of road paint on screen
  CameraRandomization randomization;  // in training; the seed is run.seed
};

}  // namespace pictura
