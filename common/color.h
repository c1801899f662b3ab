// Base colours of rendered images, which fade to black with distance. Vehicles have the colours of RAP (vita-epfl/RAP,
// renderer.py). docs/explanation/image.md lists the other colours.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Colour with channels in [0, 1].
struct Rgb {
  float r = 0, g = 0, b = 0;
};

/// Type of a channel. The range is 0 to 1 for f16 and f32, and 0 to 255 for u8 and bf16.
enum class PixelFormat : uint8_t { u8, f16, f32, bf16 };

/// Layout of an image. planar: [3, height, width]. interleaved: [height, width, 3]. patches: see patches.h; parts of
/// patches beyond the image are black.
enum class ChannelOrder : uint8_t { planar, interleaved, patches };

PICTURA_HD constexpr Rgb rgb8(int r, int g, int b) {
  return {static_cast<float>(r) / 255.0f, static_cast<float>(g) / 255.0f, static_cast<float>(b) / 255.0f};
}
PICTURA_HD constexpr Rgb operator*(Rgb c, float s) { return {c.r * s, c.g * s, c.b * s}; }

enum class AgentClass : uint8_t { vehicle, cyclist, pedestrian };
constexpr int kNumAgentClasses = 3;

enum class BoxFace : uint8_t { front, back, left, right, top };
constexpr int kNumBoxFaces = 5;

/// Depth at which every colour has faded to black.
constexpr float kVisibleRange_m = 120.0f;

PICTURA_HD constexpr Rgb agent_color(AgentClass agent_class, BoxFace face) {
  // No table, because each thread of a kernel would build it in local memory.
  auto chosen = [face](Rgb front, Rgb back, Rgb left, Rgb right, Rgb top) {
    const Rgb of_sides = face == BoxFace::left ? left : face == BoxFace::right ? right : top;
    return face == BoxFace::front ? front : face == BoxFace::back ? back : of_sides;
  };
  switch (agent_class) {
    case AgentClass::vehicle:
      return chosen(rgb8(247, 37, 133), rgb8(76, 201, 240), rgb8(114, 9, 183), rgb8(67, 97, 238), rgb8(58, 12, 163));
    case AgentClass::cyclist:
      return chosen(rgb8(255, 190, 11), rgb8(251, 133, 0), rgb8(214, 96, 10), rgb8(255, 214, 92), rgb8(150, 75, 0));
    default:
      return chosen(rgb8(128, 237, 153), rgb8(34, 139, 84), rgb8(87, 204, 120), rgb8(56, 163, 165), rgb8(22, 96, 66));
  }
}

/// State of a traffic light. Lights in state `unknown` are not drawn. Files contain these numbers, which must not
/// change.
enum class LightState : uint8_t { off, red, yellow, green, unknown };
constexpr int kNumLightStates = 5;

PICTURA_HD constexpr Rgb light_color(LightState state) {
  switch (state) {
    case LightState::off: return rgb8(80, 80, 80);
    case LightState::red: return rgb8(255, 0, 0);
    case LightState::yellow: return rgb8(255, 200, 0);
    case LightState::green: return rgb8(0, 255, 0);
    default: return {};
  }
}

constexpr Rgb kWallColor = rgb8(141, 153, 174);
constexpr Rgb kWhiteMarkColor = rgb8(225, 230, 240);
constexpr Rgb kYellowMarkColor = rgb8(240, 200, 60);
constexpr Rgb kRoadEdgeColor = rgb8(200, 36, 35);
constexpr Rgb kCrosswalkColor = rgb8(206, 131, 63);
constexpr Rgb kStopLineColor = rgb8(98, 183, 249);

}  // namespace pictura
