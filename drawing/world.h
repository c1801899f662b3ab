// Pictures of a simulated world from above: the road map, the current lights, agents as boxes, their goals, and the
// reasons why agents are halted. North is up. The map is drawn once, in tiles, so that most of a frame's time is spent
// on its agents.
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

/// A disk that is drawn over everything else. If it has a label, the label is next to it and the disk is larger.
struct WorldMark {
  Vec2 position_m;
  Rgb color;
  std::string label;
};

/// The state of one world that changes from frame to frame. Spans are read only during draw().
struct WorldFrame {
  Span<const AgentBox> agents;      // agents of this world
  Span<const LightState> lights;    // [map.lights]
  Span<const LightHead> heads;      // [map.lights] positions of heads; empty: as on the map
  Span<const AgentStatus> status;   // [agents]; empty: all agents are active
  Span<const uint8_t> halt_reason;  // [agents] Event bits; drawn as a ring and counted in the legend
  Span<const AgentGoal> goals;      // drawn with a thin line from the agent
  int highlighted = -1;             // index of the agent that is drawn with a halo and with waypoints_m, or -1
  Span<const Vec2> waypoints_m;     // remaining waypoints of the highlighted agent, nearest first
  Span<const WorldMark> marks;      // later marks cover earlier marks
  std::string caption;              // one line at the top left, or empty
  int recorded_step = -1;           // road users of the painter's scenario are drawn at this step; -1: not drawn
};

/// Draws frames of one size that show worlds on one map with walls. The constructor's arguments must outlive the
/// painter.
class WorldPainter {
 public:
  /// Prepares the map. If `scenario` is not null, the paths of all its road users are drawn on the ground. Throws Error
  /// unless both sizes are in [16, 8192] px.
  WorldPainter(const RoadMap& map, int width_px, int height_px, std::vector<WallFace> walls = {},
               const Scenario* scenario = nullptr);
  ~WorldPainter();

  int width_px() const;
  int height_px() const;

  /// Returns a camera that shows the whole map with a small margin.
  TopCamera whole_map() const;
  /// Returns a camera that shows width_m metres around a centre. The centre may move from frame to frame.
  TopCamera around(Vec2 center_m, float width_m) const;

  /// Pixel coordinates of a position.
  Vec2 pixel_of(const TopCamera& camera, Vec2 position_m) const;

  RgbImage draw(const WorldFrame& frame, const TopCamera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Draws one world of a simulator in host memory, with the active waypoint of each active agent. `followed` is an
/// agent's index in this world, or -1. That agent is highlighted with all its waypoints; if follow_width_m > 0, the
/// camera follows it.
RgbImage draw_world(WorldPainter& painter, Simulator& simulator, int world, int followed = -1, float follow_width_m = 0,
                    const std::string& caption = {});

}  // namespace pictura
