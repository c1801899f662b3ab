// Plain data of scenes, readable on both devices: the pieces of a map, moving objects, and the views from which images
// are drawn. Right-handed, in metres, z up; headings in radians, counter-clockwise.
#pragma once

#include "pictura/common/color.h"
#include "pictura/common/device.h"
#include "pictura/common/grid_view.h"
#include "pictura/common/span.h"

namespace pictura {

/// Kind of a strip on the road; its class in the optional class plane is kClassOfStrip + kind.
enum class StripKind : uint8_t { lane_mark, road_edge, crosswalk, stop_line };
constexpr int kNumStripKinds = 4;

/// One straight piece, at most kMaxPiece_m long, of a polyline painted on the road. Its corners are a -+ side_a * w/2
/// and b -+ side_b * w/2: the sides are mitred, so that consecutive pieces share an edge without overlap or gap.
/// Aligned for devices, which read 16 bytes at once.
struct alignas(16) Strip {
  Vec3 a_m, b_m;        // the two ends of the centre line
  Vec2 side_a, side_b;  // horizontal offset to the left per metre of half-width, at a and at b
  float width_m = 0;
  Rgb color;
  StripKind kind = StripKind::lane_mark;
};
constexpr float kMaxPiece_m = 10.0f;

/// An opaque vertical face from the ground up, seen from both sides.
struct alignas(8) WallFace {
  Vec3 a_m, b_m;  // the two ends of its lower edge
  float height_m = 0;
  Rgb color = kWallColor;
};

/// A disk of kLightRadius_m in the colour of its signal's state, drawn for cameras in front of it.
struct LightHead {
  Vec3 position_m;  // centre of the disk
  Vec2 facing;      // unit vector, towards the traffic that the light controls
  float cos_half_angle = 0.5f;
  int32_t signal = 0;  // index into the world's light states: the stop line that the light governs
};
constexpr float kLightRadius_m = 0.5f;

/// Box by which the uniform grids store a piece. For a strip, it bounds the four corners, which lie up to four
/// half-widths from the centre line where the strip is mitred.
PICTURA_HD inline Aabb2 ground_box(const Strip& strip) {
  const Vec2 a = strip.a_m.xy(), b = strip.b_m.xy();
  const Vec2 at_a = strip.side_a * (0.5f * strip.width_m), at_b = strip.side_b * (0.5f * strip.width_m);
  return {{min_of(a.x - fabsf(at_a.x), b.x - fabsf(at_b.x)), min_of(a.y - fabsf(at_a.y), b.y - fabsf(at_b.y))},
          {max_of(a.x + fabsf(at_a.x), b.x + fabsf(at_b.x)), max_of(a.y + fabsf(at_a.y), b.y + fabsf(at_b.y))}};
}
PICTURA_HD inline Aabb2 ground_box(const WallFace& wall) {
  return {{min_of(wall.a_m.x, wall.b_m.x), min_of(wall.a_m.y, wall.b_m.y)},
          {max_of(wall.a_m.x, wall.b_m.x), max_of(wall.a_m.y, wall.b_m.y)}};
}

/// View of a StaticGeometry that both devices read.
struct StaticGeometryView {
  Span<const Strip> strips;
  Span<const WallFace> walls;
  Span<const LightHead> heads;
  GridView strip_grid, wall_grid;
  int32_t num_signals = 0;
};

/// An agent's oriented box, standing upright on the ground.
struct AgentBox {
  Vec3 center_m;  // centre of the box's bottom face
  float cos_heading = 1, sin_heading = 0;
  float length_m = 0, width_m = 0, height_m = 0;
  AgentClass agent_class = AgentClass::vehicle;
  uint8_t palette = 0;  // 0: class colours; 1: halted, 2: parked, with the debug palette alone
  uint8_t drawn = 1;    // 0: absent from all images
  uint8_t padding = 0;
};

/// Handle of a StaticGeometry in renderers; the caller of upload() chooses it, in [0, kNumGeometryHandles).
using GeometryHandle = int32_t;
constexpr GeometryHandle kNumGeometryHandles = 1 << 16;

/// Maximum number of agents of one world of a scene: 4,096 simulated agents and as many parked cars.
constexpr int kMaxBoxesPerWorld = 8192;

/// All moving objects of all worlds at one step.
struct SceneBatch {
  Device device;                        // device of all spans
  Span<const int32_t> world_begin;      // [worlds + 1] first agent of each world; ends with the number of agents
  Span<const AgentBox> agents;          // [agents] controlled and parked agents
  Span<const GeometryHandle> geometry;  // [worlds]
  Span<const int32_t> light_begin;      // [worlds + 1] first light state of each world
  Span<const LightState> light_states;  // [light_begin.back()]
  Span<const int32_t> hidden_agents;    // lists that views refer to; usually empty
};

/// Whether a world has a light state for each of its map's signals, or no light state, in which case no light is drawn.
PICTURA_HD constexpr bool has_enough_lights(int32_t lights, int32_t signals) {
  return lights == 0 || lights >= signals;
}

/// Objects that a view leaves out of its images, as bits.
enum Hides : uint32_t {
  kHidesNothing = 0,
  kHidesAgents = 1,  // all agents
  kHidesLights = 2,  // all traffic lights
};

/// Key of the randomization of a view's cameras (common/raster/randomize_camera.h), like the keys of random numbers
/// (common/rng.h). An image that is drawn again with the same key has the same bits.
struct ViewKey {
  uint32_t world = 0;  // global
  uint32_t agent = 0;  // index in its world, below RandomKey::kMaxAgents
  uint32_t episode = 0, step = 0;
};

/// The pose of a rig. The ego's own box is left out of its images.
struct View {
  int32_t world = 0;
  int32_t ego_agent = -1;  // index into SceneBatch::agents, or -1: no agent is left out
  Vec3 origin_m;           // the rig's origin, on the ground
  float cos_heading = 1, sin_heading = 0;
  float body_length_m = kRigBodyLength_m;    // shrinks the x offsets of the cameras of short bodies
  int32_t hidden_begin = 0, hidden_end = 0;  // further hidden agents: a range of SceneBatch::hidden_agents
  uint32_t hides = kHidesNothing;            // bits of Hides
  ViewKey key;

  static constexpr float kRigBodyLength_m = 4.5f;
};

/// Whether a cosine and a sine form a direction. Headings are computed in float, so a small drift is accepted.
PICTURA_HD inline bool is_direction(float cosine, float sine) {
  return fabsf(cosine * cosine + sine * sine - 1.0f) < 1e-2f;
}
/// Whether a view's pose is finite and valid.
PICTURA_HD inline bool has_finite_pose(const View& view) {
  return is_finite(view.origin_m) && is_direction(view.cos_heading, view.sin_heading) && view.body_length_m >= 0.0f &&
         is_finite(view.body_length_m);
}
PICTURA_HD inline bool has_valid_hidden_range(const View& view, size_t hidden_agents) {
  return view.hidden_begin >= 0 && view.hidden_begin <= view.hidden_end &&
         static_cast<size_t>(view.hidden_end) <= hidden_agents;
}

/// Query of the visible share of an agent in a view.
struct VisibilityQuery {
  int32_t view = 0;
  int32_t agent = 0;  // index into SceneBatch::agents
};

}  // namespace pictura
