// Conversion of a scene's images to one picture and back.
#pragma once

#include <string>
#include <vector>

#include "pictura/bench/truth/image_truth.h"
#include "pictura/bench/truth/tolerances.h"
#include "pictura/common/scene_file.h"

namespace pictura {

/// Channel values in [0, 1]: [views x cameras][3 x height x width].
using Drawing = std::vector<std::vector<float>>;

/// `format` must be u8 or f32.
Drawing draw_scene(Renderer* renderer, const SceneFile& scene, PixelFormat format);

/// Returns the ray caster's images.
Drawing trace_scene(const SceneFile& scene);

/// Returns a picture with a row per view and a column per camera, with grey gaps.
RgbImage to_picture(const SceneFile& scene, const Drawing& drawing);

/// Inverse of to_picture(). Throws Error if the picture's size is wrong.
Drawing from_picture(const SceneFile& scene, const RgbImage& picture);

/// Returns |a - b| times eight.
Drawing difference(const Drawing& a, const Drawing& b);

/// Enlarges four times, without smoothing.
RgbImage enlarged(const RgbImage& picture);

PooledError error_of(const Drawing& actual, const Drawing& expected);

/// Why the error exceeds the tolerance; empty if it does not.
std::string complaint(const PooledError& error, const ImageTolerance& tolerance);

}  // namespace pictura
