// One simulated world from above: the road map, the current lights, agents as boxes, their goals, and the reasons of
// halted agents. North is up. The map is drawn once, in tiles, so that a frame costs little more than its agents.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/image.h"
#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// An orthographic camera that faces down.
struct TopCamera {
  Vec2 center_m;
  float px_per_m = 4;
};

/// An agent's active waypoint.
struct AgentGoal {
  int agent = 0;  // index into WorldFrame::agents
  Vec2 position_m;
};

/// A disk over everything else; a disk with a label beside it is larger.
struct WorldMark {
  Vec2 position_m;
  Rgb color;
  std::string label;
};

/// Changing state of one world; spans are read only during draw().
struct WorldFrame {
  Span<const AgentBox> agents;      // agents of this world
  Span<const LightState> lights;    // [map.lights]
  Span<const LightHead> heads;      // [map.lights] positions of heads, or empty: as mapped
  Span<const AgentStatus> status;   // [agents] or empty: all active
  Span<const uint8_t> halt_reason;  // [agents] Event bits: a ring in the colour of the reason, and counts in the legend
  Span<const AgentGoal> goals;      // each gets a thin line from its agent
  int highlighted = -1;             // index of the agent with a halo and the waypoints below, or -1
  Span<const Vec2> waypoints_m;     // waypoints that the highlighted agent has still to pass, nearest first
  Span<const WorldMark> marks;      // the last covers earlier ones
  std::string caption;              // one line at the top left, or empty
  int recorded_step = -1;           // step of the painter's scenario whose road users are drawn; -1: none
};

/// Draws frames of one size of worlds on one map, with its walls. The arguments must outlive the painter.
class WorldPainter {
 public:
  /// Prepares the map; the paths of all road users of a scenario on the map are drawn on the ground. Throws Error
  /// unless both sizes are in [16, 8192] px.
  WorldPainter(const RoadMap& map, int width_px, int height_px, std::vector<WallFace> walls = {},
               const Scenario* scenario = nullptr);
  ~WorldPainter();

  int width_px() const;
  int height_px() const;

  /// Camera for the whole map, with a small margin.
  TopCamera whole_map() const;
  /// Camera for width_m metres around a centre, which may move from frame to frame.
  TopCamera around(Vec2 center_m, float width_m) const;

  /// Pixel coordinates of a position.
  Vec2 pixel_of(const TopCamera& camera, Vec2 position_m) const;

  RgbImage draw(const WorldFrame& frame, const TopCamera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Draws one world of a simulator in host memory, with the active waypoint of each active agent. `followed` (a slot of
/// this world, counted from its first slot, or -1) is highlighted with all its waypoints and, if follow_width_m > 0,
/// followed by the camera.
RgbImage draw_world(WorldPainter& painter, Simulator& simulator, int world, int followed = -1, float follow_width_m = 0,
                    const std::string& caption = {});

}  // namespace pictura
