// Plain data of scenes for host and CUDA code: the drawn parts of a map, moving objects, and the views from which
// images are drawn. World coordinates are right-handed, in metres, with z up. Headings are counter-clockwise, in
// radians.
#pragma once

#include "pictura/common/color.h"
#include "pictura/common/device.h"
#include "pictura/common/grid_view.h"
#include "pictura/common/span.h"

namespace pictura {

/// Kind of a strip of road paint. Its value in the optional CameraImages::class_id is kClassOfStrip + kind.
enum class StripKind : uint8_t { lane_mark, road_edge, crosswalk, stop_line };
constexpr int kNumStripKinds = 4;

/// One straight piece, at most kMaxPiece_m long, of a polyline painted on the road. Its corners are a_m +- side_a *
/// width_m / 2 and b_m +- side_b * width_m / 2. The ends are mitred, so that consecutive pieces share an edge without
/// overlap or gap. Aligned, because a CUDA thread loads 16 bytes in one instruction.
struct alignas(16) Strip {
  Vec3 a_m, b_m;        // the two ends of the centre line
  Vec2 side_a, side_b;  // horizontal offset to the left per metre of half-width, at a and at b
  float width_m = 0;
  Rgb color;
  StripKind kind = StripKind::lane_mark;
};
constexpr float kMaxPiece_m = 10.0f;

/// An opaque vertical face that begins on the ground and is visible from both sides.
struct alignas(8) WallFace {
  Vec3 a_m, b_m;  // the two ends of its lower edge
  float height_m = 0;
  Rgb color = kWallColor;
};

/// Head of a traffic light: a disk of radius kLightRadius_m in the colour of its signal's state. Only cameras in front
/// of the disk see it.
struct LightHead {
  Vec3 position_m;  // centre of the disk
  Vec2 facing;      // unit vector, towards the traffic that the light controls
  float cos_half_angle = 0.5f;
  int32_t signal = 0;  // index of the light's stop line among the world's light states
};
constexpr float kLightRadius_m = 0.5f;

/// Bounding box on the ground plane, by which the uniform grids store a strip or wall. The mitred corners of a strip
/// are up to four half-widths from its centre line.
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

/// Non-owning view of a StaticGeometry for host and CUDA code.
struct StaticGeometryView {
  Span<const Strip> strips;
  Span<const WallFace> walls;
  Span<const LightHead> heads;
  GridView strip_grid, wall_grid;
  int32_t num_signals = 0;
};

/// An agent's oriented box, which is upright.
struct AgentBox {
  Vec3 center_m;  // centre of the box's bottom face
  float cos_heading = 1, sin_heading = 0;
  float length_m = 0, width_m = 0, height_m = 0;
  AgentClass agent_class = AgentClass::vehicle;
  uint8_t palette = 0;  // 0: class colours; 1 (halted) and 2 (parked): tinted if debug_palette is on
  uint8_t drawn = 1;    // 0: absent from all images
  uint8_t padding = 0;
};

/// Handle of a StaticGeometry in renderers. The caller of Renderer::upload() chooses it in [0, kNumGeometryHandles).
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
  Span<const int32_t> hidden_agents;    // lists of agents that views leave out; usually empty
};

/// Whether a world has a light state for each signal of its map, or no light states at all. Without light states, no
/// light is drawn.
PICTURA_HD constexpr bool has_enough_lights(int32_t lights, int32_t signals) {
  return lights == 0 || lights >= signals;
}

/// Bits for the objects that a view leaves out of its images.
enum Hides : uint32_t {
  kHidesNothing = 0,
  kHidesAgents = 1,  // all agents
  kHidesLights = 2,  // all traffic lights
};

/// Key of the random numbers that randomize a view's cameras (common/raster/randomize_camera.h). The members mean the
/// same as in RandomKey (common/rng.h). An image that is drawn again with the same key has the same bits.
struct ViewKey {
  uint32_t world = 0;  // global id
  uint32_t agent = 0;  // index in its world, below RandomKey::kMaxAgents
  uint32_t episode = 0, step = 0;
};

/// Pose of a camera rig in a world. The images omit the box of the ego, the agent that carries the rig.
struct View {
  int32_t world = 0;
  int32_t ego_agent = -1;  // index into SceneBatch::agents; -1: no agent is omitted
  Vec3 origin_m;           // the rig's origin, on the ground
  float cos_heading = 1, sin_heading = 0;
  float body_length_m = kRigBodyLength_m;    // below kRigBodyLength_m, the cameras' x offsets shrink
  int32_t hidden_begin = 0, hidden_end = 0;  // further hidden agents: a range of SceneBatch::hidden_agents
  uint32_t hides = kHidesNothing;            // bits of Hides
  ViewKey key;

  static constexpr float kRigBodyLength_m = 4.5f;
};

/// Whether a cosine and a sine form a unit vector. Small errors are accepted, because headings are computed in float.
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

/// Query of the visible share of an agent in a view, see Renderer::visibility().
struct VisibilityQuery {
  int32_t view = 0;
  int32_t agent = 0;  // index into SceneBatch::agents
};

}  // namespace pictura
