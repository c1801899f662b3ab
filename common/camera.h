// Cameras and rigs. The ego is the agent that carries a rig. The ego frame has x forward, y left and z up, in metres.
// Its origin is on the ground: below a vehicle's or cyclist's rear axle, or below a pedestrian's centre. Image
// coordinates begin at the top left corner, and pixel centres are at +0.5.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/math.h"

namespace pictura {

/// A pinhole camera of a rig.
struct Camera {
  std::string name;
  int width_px = 0, height_px = 0;
  float focal_x_px = 0, focal_y_px = 0;
  float center_x_px = 0, center_y_px = 0;  // principal point
  Vec3 position_m;                         // in the ego frame
  float yaw_rad = 0;                       // counter-clockwise about z; 0: forward
  float pitch_rad = 0;                     // positive: up
  float roll_rad = 0;                      // positive: clockwise, seen from behind the camera
};

/// Cameras, in the order of an ImageBatch's cameras.
struct Rig {
  std::vector<Camera> cameras;
};

/// Returns the four cameras of the Pictura paper (appendix, table of the camera rig): front, front-left, front-right
/// and back. A size that is not 16:9 keeps the fields of view, but its pixels are not square. With square_pixels, it
/// keeps only the horizontal field of view. Throws Error unless both sizes are in [1, 8192].
Rig paper_rig(int width_px = 96, int height_px = 54, bool square_pixels = false);

/// Reads a rig from a TOML file (docs/explanation/image.md). Throws Error naming the file, the camera and the key.
Rig load_rig(const std::string& path);

/// Throws Error unless the rig has 1 to 64 cameras with sizes in [1, 8192] px, positive focal lengths and finite poses.
void validate(const Rig& rig);

/// Unit vectors in the ego frame.
struct CameraAxes {
  Vec3 right, down, forward;
};
CameraAxes camera_axes(const Camera& camera);

}  // namespace pictura
