// A scene's images as one picture, and the difference of two pictures.
#pragma once

#include <string>
#include <vector>

#include "pictura/bench/truth/image_truth.h"
#include "pictura/bench/truth/tolerances.h"
#include "pictura/common/scene_file.h"

namespace pictura {

/// Channel values in [0, 1] of all images of a scene: [views x cameras][3 x height x width].
using Drawing = std::vector<std::vector<float>>;

/// Draws with a backend that uses host memory, in bytes or in floats.
Drawing draw_scene(Renderer* renderer, const SceneFile& scene, PixelFormat format);

/// Returns the truth's images of the scene.
Drawing trace_scene(const SceneFile& scene);

/// Returns a picture with rows of views and columns of cameras, grey in the gaps.
RgbImage to_picture(const SceneFile& scene, const Drawing& drawing);

/// Returns the images of a picture made by to_picture(). Throws Error if its size does not match the scene.
Drawing from_picture(const SceneFile& scene, const RgbImage& picture);

/// Returns |a - b| times eight.
Drawing difference(const Drawing& a, const Drawing& b);

/// Returns the picture with every pixel as a square of 4 x 4.
RgbImage enlarged(const RgbImage& picture);

/// Pools the error over all images.
PooledError error_of(const Drawing& actual, const Drawing& expected);

/// Returns why the error exceeds the tolerance, or an empty string.
std::string complaint(const PooledError& error, const ImageTolerance& tolerance);

}  // namespace pictura
