// Conversion of a scene's images to one picture and back, and differences between images.
#pragma once

#include <string>
#include <vector>

#include "pictura/bench/truth/image_truth.h"
#include "pictura/bench/truth/tolerances.h"
#include "pictura/common/scene_file.h"

namespace pictura {

/// Channel values in [0, 1] of all images of a scene: [views x cameras][3 x height x width].
using Drawing = std::vector<std::vector<float>>;

/// Draws a scene with a renderer on host memory. `format` must be u8 or f32.
Drawing draw_scene(Renderer* renderer, const SceneFile& scene, PixelFormat format);

/// Returns the images of the scene by the ray caster (bench/truth/image_truth.h).
Drawing trace_scene(const SceneFile& scene);

/// Returns a picture with a row for each view and a column for each camera, with grey gaps.
RgbImage to_picture(const SceneFile& scene, const Drawing& drawing);

/// Returns the images of a picture made by to_picture(). Throws Error if its size does not match the scene.
Drawing from_picture(const SceneFile& scene, const RgbImage& picture);

/// Returns |a - b| times eight.
Drawing difference(const Drawing& a, const Drawing& b);

/// Returns the picture enlarged four times, without smoothing.
RgbImage enlarged(const RgbImage& picture);

/// Returns the error, pooled over all images.
PooledError error_of(const Drawing& actual, const Drawing& expected);

/// Returns a text that explains why the error exceeds the tolerance; empty if it does not.
std::string complaint(const PooledError& error, const ImageTolerance& tolerance);

}  // namespace pictura
