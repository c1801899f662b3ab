// One simulated world from above: the road map, the current lights, agents as boxes, their goals, and why some have
// halted. North is up. The map is drawn once, in tiles, so that a frame costs little more than its agents.
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

/// An orthographic camera that looks down.
struct TopCamera {
  Vec2 center_m;
  float px_per_m = 4;
};

/// An agent's active waypoint.
struct AgentGoal {
  int agent = 0;  // index into WorldFrame::agents
  Vec2 position_m;
};

/// A disk over everything else; one with a label, which stands beside it, is larger.
struct WorldMark {
  Vec2 position_m;
  Rgb color;
  std::string label;
};

/// The changing state of one world; spans are read only during draw().
struct WorldFrame {
  Span<const AgentBox> agents;      // of this world
  Span<const LightState> lights;    // [map.lights]
  Span<const LightHead> heads;      // [map.lights] where heads stand, or empty: as mapped
  Span<const AgentStatus> status;   // [agents] or empty: all active
  Span<const uint8_t> halt_reason;  // [agents] Event bits: a ring in the colour of the reason, and a legend that counts
  Span<const AgentGoal> goals;      // a thin line leads to each
  int highlighted = -1;             // index of the agent with a halo and the waypoints below, or -1
  Span<const Vec2> waypoints_m;     // those not yet passed, nearest first
  Span<const WorldMark> marks;      // the last covers those before
  std::string caption;              // one line at the top left, or empty
  int recorded_step = -1;           // of the painter's scenario: its road users as recorded then; -1: none
};

/// Draws frames of one size of worlds on one map, with its walls. What it is given must outlive it.
class WorldPainter {
 public:
  /// The ways of all road users of a scenario on that map lie on the ground. Throws Error unless both sizes are in
  /// [16, 8192] px.
  WorldPainter(const RoadMap& map, int width_px, int height_px, std::vector<WallFace> walls = {},
               const Scenario* scenario = nullptr);
  ~WorldPainter();

  int width_px() const;
  int height_px() const;

  /// The camera that shows the whole map, with a small margin.
  TopCamera whole_map() const;
  /// The camera that shows width_m metres around a centre, which may move from frame to frame.
  TopCamera around(Vec2 center_m, float width_m) const;

  /// Pixel coordinates of a position.
  Vec2 pixel_of(const TopCamera& camera, Vec2 position_m) const;

  RgbImage draw(const WorldFrame& frame, const TopCamera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Draws one world of a simulator in host memory, with the active waypoint of each active agent; `followed` (a slot of
/// that world counted from its first, or -1) is highlighted with all its waypoints and, if follow_width_m > 0, the
/// camera follows it.
RgbImage draw_world(WorldPainter& painter, Simulator& simulator, int world, int followed = -1, float follow_width_m = 0,
                    const std::string& caption = {});

}  // namespace pictura
