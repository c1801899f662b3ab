// Pictures of an image's optional planes: depth, class and instance.
#pragma once

#include <string>

#include "pictura/common/image.h"

namespace pictura {

enum class Plane { depth, class_id, instance_id };

/// Returns the plane named "depth", "class" or "instance". Throws UsageError for other names.
Plane plane_by_name(const std::string& name);

/// Draws a plane of one image, black at pixels without a surface. Depth: grey 255 x (1 - depth / 120 m), at least 1.
/// Class: the colour of the object's kind in docs/explanation/image.md; vehicles have the colour of their right side.
/// Instance: a different hue for each agent, and black elsewhere.
RgbImage plane_picture(const HostImages& images, int view, int camera, Plane plane);

}  // namespace pictura
