// A driver that keeps its lane, goes where its waypoints lead, and stops at red lights, alone in its world: what the
// rules ask for can be driven with the jerk actions.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/step.h"
#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// Drives agent 0 of a world.
class LaneDriver {
 public:
  /// `world` shows the simulator's agents and lights as they are at every act(), and has not been stepped yet; the
  /// graph is its map's. Both must outlive the driver.
  LaneDriver(const WorldView& world, const LaneGraph& graph);

  /// The action for what the agent and the lights are now.
  int32_t act();
  /// Steps in which it waited at a red light.
  int stops() const { return stops_; }

 private:
  /// A lane of the route. If it lies beside the one before, the route changes to it at change_at_m of that one.
  struct Stretch {
    int32_t lane = -1;
    float change_at_m = 0;
  };
  /// A place ahead: s_m along the lane of that index of the route, less what lane changes on the way there would move
  /// it to the left.
  struct Mark {
    size_t index = 0;
    float s_m = 0;
    float moved_left_m = 0;
  };

  void plan();
  void give_up_change();
  bool is_too_late_to_change() const;
  bool is_beside(int32_t from, int32_t to) const;
  void go_on_from(RoutePoint from, float planned_m);
  void append_route(RoutePoint from, const std::vector<int32_t>& lanes);
  void append_way_on(float distance_m);
  Mark moved(Mark at, float distance_m) const;
  LanePose pose(float distance_m) const;
  float still_aside_m() const;
  float middle_of_room_m(const LanePose& at) const;
  Vec2 target(float distance_m) const;
  void find_place(Vec2 axle);
  float wanted_speed(float speed_mps, float bumper_m);
  float to_closed_line(float speed_mps, float bumper_m) const;
  const MapLane& lane(int32_t index) const { return world_.map.lanes[static_cast<size_t>(index)]; }
  bool is_change(int32_t from, int32_t to) const { return to == lane(from).left || to == lane(from).right; }

  const WorldView world_;
  const LaneGraph& graph_;
  std::vector<Stretch> route_;
  Mark at_;
  float travelled_m_ = 0;                    // along the route since it was planned
  float to_waypoint_m_[kNumWaypoints] = {};  // from where it was planned
  std::array<RoutePoint, kNumWaypoints> waypoints_;
  int32_t chain_ = -1;  // whose waypoints these are
  int stops_ = 0;
};

/// What became of a lane driver.
struct DrivenEpisode {
  int goals = 0;  // last waypoints passed within 2 m
  int halt_reason = kEventNone;
  int stops = 0;
  float distance_m = 0;
  Vec2 end_m;
};

/// Drives for `steps` steps, or until an infraction, in so many worlds on the map, each driver alone, from the first
/// episode of config.seed on. The share of cyclists is config.cyclist_fraction; the rest is as in evaluation: waypoints
/// of 2 m, lights with fixed timing, no multipliers.
std::vector<DrivenEpisode> drive_lanes(const std::shared_ptr<const RoadMap>& map, SimulatorConfig config,
                                       int num_worlds, int steps);

}  // namespace pictura::testing
