// Pictures of a simulated world from above, with north up.
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

/// Orthographic camera that faces down.
struct TopCamera {
  Vec2 center_m;
  float px_per_m = 4;
};

/// Active waypoint of an agent.
struct AgentGoal {
  int agent = 0;  // index in WorldFrame::agents
  Vec2 position_m;
};

/// Disk over everything else; larger if it has a label.
struct WorldMark {
  Vec2 position_m;
  Rgb color;
  std::string label;
};

/// State of one world in a frame. Spans are read only during draw().
struct WorldFrame {
  Span<const AgentBox> agents;
  Span<const LightState> lights;    // [map.lights]
  Span<const LightHead> heads;      // [map.lights] positions; empty: as on the map
  Span<const AgentStatus> status;   // [agents]; empty: all active
  Span<const uint8_t> halt_reason;  // [agents] Event bits; shown as a ring and in the legend
  Span<const AgentGoal> goals;      // joined to the agent by a thin line
  int highlighted = -1;             // agent with a halo and waypoints_m if it is drawn; -1: none
  Span<const Vec2> waypoints_m;     // remaining waypoints of the highlighted agent, nearest first
  Span<const WorldMark> marks;      // later marks cover earlier marks
  std::string caption;              // top left line, or empty
  int recorded_step = -1;           // step at which the painter's scenario is drawn; -1: not drawn
};

/// Draws frames of worlds on one map with walls. The constructor's arguments must outlive the painter.
class WorldPainter {
 public:
  /// If `scenario` is not null, the paths of its road users are drawn on the ground. Throws Error unless both sizes are
  /// in [16, 8192] px.
  WorldPainter(const RoadMap& map, int width_px, int height_px, std::vector<WallFace> walls = {},
               const Scenario* scenario = nullptr);
  ~WorldPainter();

  int width_px() const;
  int height_px() const;

  /// Shows the whole map with a small margin.
  TopCamera whole_map() const;
  /// Shows width_m metres around a centre.
  TopCamera around(Vec2 center_m, float width_m) const;

  Vec2 pixel_of(const TopCamera& camera, Vec2 position_m) const;

  RgbImage draw(const WorldFrame& frame, const TopCamera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Draws one world of a simulator in host memory. `followed`: index of the highlighted agent in this world, or -1. If
/// follow_width_m > 0, the camera follows it. While it is absent, the whole map is shown.
RgbImage draw_world(WorldPainter& painter, Simulator& simulator, int world, int followed = -1, float follow_width_m = 0,
                    const std::string& caption = {});

}  // namespace pictura
