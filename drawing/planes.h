// Pictures of an image's depth, class and instance.
#pragma once

#include <string>

#include "pictura/common/image.h"

namespace pictura {

enum class Plane { depth, class_id, instance_id };

/// Throws UsageError for names other than "depth", "class" and "instance".
Plane plane_by_name(const std::string& name);

/// Draws a plane of one image, black at pixels without a surface. Depth: grey 255 x (1 - depth / 120 m), at least 1.
/// Class: colours of docs/explanation/image.md; vehicles have the colour of their right side. Instance: one hue per
/// agent, black elsewhere.
RgbImage plane_picture(const HostImages& images, int view, int camera, Plane plane);

}  // namespace pictura
