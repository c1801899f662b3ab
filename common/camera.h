// Cameras and rigs. A rig is mounted on an agent, the ego. The ego frame has x forward, y left and z up, in metres. Its
// origin is on the ground: below the rear axle of a vehicle or cyclist, or below the box centre of a pedestrian. Image
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
  float focal_x_px = 0, focal_y_px = 0;    // focal lengths
  float center_x_px = 0, center_y_px = 0;  // principal point, from the image's top left corner
  Vec3 position_m;                         // in the ego frame
  float yaw_rad = 0;                       // about z, counter-clockwise; 0: the camera faces forward
  float pitch_rad = 0;                     // positive: the camera faces up
  float roll_rad = 0;                      // positive turns the camera clockwise, as seen from behind it
};

/// Cameras with images of any sizes. A camera has the same index in the rig and in an ImageBatch.
struct Rig {
  std::vector<Camera> cameras;
};

/// Returns the four cameras of the Pictura paper (appendix, table of the camera rig): front, front-left, front-right
/// and back. The focal length of 1545 px at 1920x1080 is scaled to the given size. If the size is not 16:9, both fields
/// of view are kept and pixels are not square. With square_pixels, only the horizontal field of view is kept. Throws
/// Error unless both sizes are in [1, 8192].
Rig paper_rig(int width_px = 96, int height_px = 54, bool square_pixels = false);

/// Reads a rig from a TOML file (docs/explanation/image.md shows one). The message of an Error names the file, the
/// camera and the key.
Rig load_rig(const std::string& path);

/// Throws Error unless the rig has 1 to 64 cameras with sizes in [1, 8192] px, positive focal lengths and finite poses.
void validate(const Rig& rig);

/// Axes of a camera, as unit vectors in the ego frame. Camera coordinates are (right, down, forward).
struct CameraAxes {
  Vec3 right, down, forward;
};
CameraAxes camera_axes(const Camera& camera);

}  // namespace pictura
