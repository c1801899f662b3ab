// Depth, class and instance planes as pictures.
#pragma once

#include <string>

#include "pictura/common/image.h"

namespace pictura {

enum class Plane { depth, class_id, instance_id };

/// Returns the plane named "depth", "class" or "instance". Throws UsageError for other names.
Plane plane_by_name(const std::string& name);

/// Draws a plane of one image, black at pixels without a surface. Depth: grey 255 x (1 - depth / 120 m), at least 1.
/// Class: the colour of the object's kind in docs/explanation/image.md (for vehicles, of the right side). Instance: a
/// hue per agent, black elsewhere.
RgbImage plane_picture(const HostImages& images, int view, int camera, Plane plane);

}  // namespace pictura
