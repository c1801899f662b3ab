// Plain data of scenes, for host and CUDA code. World coordinates are right-handed, in metres, with z up. Headings are
// counter-clockwise, in radians.
#pragma once

#include "pictura/common/color.h"
#include "pictura/common/device.h"
#include "pictura/common/grid_view.h"
#include "pictura/common/span.h"

namespace pictura {

/// Kind of a strip of road paint. Its class (CameraImages::class_id) is kClassOfStrip + kind.
enum class StripKind : uint8_t { lane_mark, road_edge, crosswalk, stop_line };
constexpr int kNumStripKinds = 4;

/// Straight piece, at most kMaxPiece_m long, of road paint. Its corners are a_m +- side_a * width_m / 2 and b_m +-
/// side_b * width_m / 2. The ends are mitred: consecutive pieces share an edge.
struct alignas(16) Strip {
  Vec3 a_m, b_m;        // ends of the centre line
  Vec2 side_a, side_b;  // horizontal offset to the left per metre of half-width
  float width_m = 0;
  Rgb color;
  StripKind kind = StripKind::lane_mark;
};
constexpr float kMaxPiece_m = 10.0f;

/// An opaque vertical face, visible from both sides.
struct alignas(8) WallFace {
  Vec3 a_m, b_m;  // ends of the lower edge
  float height_m = 0;
  Rgb color = kWallColor;
};

/// Head of a traffic light: a disk in its signal's colour, visible only from the front.
struct LightHead {
  Vec3 position_m;
  Vec2 facing;  // unit vector towards the controlled traffic
  float cos_half_angle = 0.5f;
  int32_t signal = 0;  // index into the world's light states
};
constexpr float kLightRadius_m = 0.5f;

/// Bounding box on the ground plane. The mitred corners of a strip are up to four half-widths from its centre line.
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

/// Non-owning view of a StaticGeometry.
struct StaticGeometryView {
  Span<const Strip> strips;
  Span<const WallFace> walls;
  Span<const LightHead> heads;
  GridView strip_grid, wall_grid;
  int32_t num_signals = 0;
};

/// An agent's upright, oriented box.
struct AgentBox {
  Vec3 center_m;  // centre of the bottom face
  float cos_heading = 1, sin_heading = 0;
  float length_m = 0, width_m = 0, height_m = 0;
  AgentClass agent_class = AgentClass::vehicle;
  uint8_t palette = 0;  // 0: class colours; 1 (halted) and 2 (parked): tinted by debug_palette
  uint8_t drawn = 1;    // 0: not drawn
  uint8_t padding = 0;
};

/// Handle of a StaticGeometry in renderers, in [0, kNumGeometryHandles).
using GeometryHandle = int32_t;
constexpr GeometryHandle kNumGeometryHandles = 1 << 16;

/// Maximum number of agents per world: 4,096 simulated agents and as many parked cars.
constexpr int kMaxBoxesPerWorld = 8192;

/// All moving objects of all worlds at one step.
struct SceneBatch {
  Device device;                        // device of all spans
  Span<const int32_t> world_begin;      // [worlds + 1] first agent of each world
  Span<const AgentBox> agents;          // [agents]
  Span<const GeometryHandle> geometry;  // [worlds]
  Span<const int32_t> light_begin;      // [worlds + 1] first light state of each world
  Span<const LightState> light_states;  // [light_begin.back()]
  Span<const int32_t> hidden_agents;    // lists of agents that views exclude
};

/// Whether a world has light states for all signals of its map, or none. Without light states, no light is drawn.
PICTURA_HD constexpr bool has_enough_lights(int32_t lights, int32_t signals) {
  return lights == 0 || lights >= signals;
}

/// Bits for objects that a view excludes.
enum Hides : uint32_t {
  kHidesNothing = 0,
  kHidesAgents = 1,
  kHidesLights = 2,
};

/// Key of the random numbers that randomize a view's cameras (common/raster/randomize_camera.h). See RandomKey
/// (common/rng.h).
struct ViewKey {
  uint32_t world = 0;
  uint32_t agent = 0;  // below RandomKey::kMaxAgents
  uint32_t episode = 0, step = 0;
};

/// Pose of a camera rig in a world. The ego, the agent with the rig, is not drawn.
struct View {
  int32_t world = 0;
  int32_t ego_agent = -1;  // index into SceneBatch::agents; -1: none
  Vec3 origin_m;           // on the ground
  float cos_heading = 1, sin_heading = 0;
  float body_length_m = kRigBodyLength_m;    // if shorter than kRigBodyLength_m, the cameras' x offsets shrink
  int32_t hidden_begin = 0, hidden_end = 0;  // range of SceneBatch::hidden_agents, also not drawn
  uint32_t hides = kHidesNothing;
  ViewKey key;

  static constexpr float kRigBodyLength_m = 4.5f;
};

/// Whether (cosine, sine) is a unit vector, up to rounding.
PICTURA_HD inline bool is_direction(float cosine, float sine) {
  return fabsf(cosine * cosine + sine * sine - 1.0f) < 1e-2f;
}
PICTURA_HD inline bool has_finite_pose(const View& view) {
  return is_finite(view.origin_m) && is_direction(view.cos_heading, view.sin_heading) && view.body_length_m >= 0.0f &&
         is_finite(view.body_length_m);
}
PICTURA_HD inline bool has_valid_hidden_range(const View& view, size_t hidden_agents) {
  return view.hidden_begin >= 0 && view.hidden_begin <= view.hidden_end &&
         static_cast<size_t>(view.hidden_end) <= hidden_agents;
}

/// Query for Renderer::visibility().
struct VisibilityQuery {
  int32_t view = 0;
  int32_t agent = 0;  // index into SceneBatch::agents
};

}  // namespace pictura
