#include "pictura/drawing/planes.h"

#include <cmath>

#include "pictura/common/color.h"
#include "pictura/common/error.h"
#include "pictura/common/math.h"

namespace pictura {

namespace {

// Colours of the classes, from class 0 (nothing), as in docs/explanation/image.md.
constexpr Rgb kClassColors[] = {{},
                                agent_color(AgentClass::vehicle, BoxFace::right),
                                agent_color(AgentClass::cyclist, BoxFace::front),
                                agent_color(AgentClass::pedestrian, BoxFace::front),
                                kWallColor,
                                light_color(LightState::green),
                                kWhiteMarkColor,
                                kRoadEdgeColor,
                                kCrosswalkColor,
                                kStopLineColor};

// Gives consecutive numbers distant hues, by steps of the golden ratio around the circle of hues.
Rgb hue_of(int instance) {
  const float hue = 6 * std::fmod(0.61803399f * static_cast<float>(instance), 1.0f);
  auto channel = [&](float shift) {
    const float at = std::fmod(hue + shift, 6.0f);
    return 0.25f + 0.75f * clamp(std::abs(at - 3) - 1, 0.0f, 1.0f);
  };
  return {channel(0), channel(4), channel(2)};
}

// Grey that darkens with depth. It is never black, because black means no surface.
Rgb grey_of(float depth_m) {
  const float value = clamp(1.0f - depth_m / kVisibleRange_m, 1.0f / 255, 1.0f);
  return {value, value, value};
}

}  // namespace

Plane plane_by_name(const std::string& name) {
  if (name == "depth") return Plane::depth;
  if (name == "class") return Plane::class_id;
  if (name == "instance") return Plane::instance_id;
  fail_usage("plane: expected depth, class or instance; got '{}'", name);
}

RgbImage plane_picture(const HostImages& images, int view, int camera, Plane plane) {
  const CameraImages& image = images.camera(camera);
  PICTURA_CHECK(image.depth_m && image.class_id && image.instance_id, "picture of a plane: the images have no planes");
  const std::size_t pixels = static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px);
  RgbImage picture{image.width_px, image.height_px, std::vector<uint8_t>(3 * pixels)};
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::size_t at = static_cast<std::size_t>(view) * pixels + i;
    Rgb color;
    if (plane == Plane::depth && std::isfinite(image.depth_m[at])) {
      color = grey_of(image.depth_m[at]);
    } else if (plane == Plane::class_id) {
      PICTURA_CHECK(image.class_id[at] < std::size(kClassColors), "picture of a plane: unknown class {}",
                    image.class_id[at]);
      color = kClassColors[image.class_id[at]];
    } else if (plane == Plane::instance_id && image.instance_id[at] > 0) {
      color = hue_of(image.instance_id[at]);
    }
    const float channels[] = {color.r, color.g, color.b};
    for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * i + c] = static_cast<uint8_t>(std::lround(255 * channels[c]));
  }
  return picture;
}

}  // namespace pictura
