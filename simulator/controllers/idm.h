// Intelligent driver model (IDM): agents follow recorded paths or lanes, and keep a distance from obstacles on their
// path. Runs only on the host.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/rules/map_view.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Parameters of the IDM (Treiber, Hennecke and Helbing, Congested traffic states in empirical observations and
/// microscopic simulations, 2000). The values are those of Waymax's waypoint-following agents.
struct IdmParameters {
  float wanted_mps = 30;
  float min_gap_m = 2;
  float headway_s = 2;
  float accel_mps2 = 2, brake_mps2 = 4;
  float exponent = 4;
  float look_ahead_m = 10;
};

/// Returns the acceleration at speed_mps behind a road user that is gap_m ahead and has the speed front_mps. An
/// infinite gap means that there is no road user in front.
float idm_acceleration(const IdmParameters& parameters, float speed_mps, float gap_m, float front_mps);

/// Path of an agent: positions of its reference point with headings. Each position is at least kMinPiece_m from the
/// previous position.
struct FollowedPath {
  static constexpr float kMinPiece_m = 0.5f;
  std::vector<Vec3> points_m;
  std::vector<float> heading_rad;
  std::vector<float> s_m;  // arc length along the path
  bool ends = true;        // false: lanes continue beyond the path

  /// Adds a position, unless it is less than kMinPiece_m from the last position.
  void add(Vec3 point_m, float its_heading_rad);
  float length_m() const { return s_m.back(); }
  /// Returns the arc length of the path's point nearest to p. Searches the path from about `from_s_m` on.
  float nearest_m(Vec2 p, float from_s_m) const;
  struct Pose {
    Vec3 position_m;
    float heading_rad = 0;
  };
  Pose at(float s_m) const;
};

/// Returns a path from a pose to the centre line of the lane and along the following lanes, for 200 m or to the end of
/// the lanes. At a fork, the path takes the straightest successor on which routes may continue
/// (MapLane::num_successors). If there is none, it takes the straightest of all successors. At a lane without
/// successors, the path changes to the nearest lane beside it that has successors. If there is no room for the change,
/// the path ends where the front bumper, front_m ahead of the reference point, is still before the lane's end. If
/// `lane` is -1, the path consists of the pose alone.
FollowedPath path_along_lanes(const MapView& map, int32_t lane, Vec3 position_m, float heading_rad, float front_m);

enum class IdmPaths {
  logged,  // along recorded paths; on maps without a record, along lanes
  lanes,   // along lanes for all vehicles and cyclists
};

/// Moves every commanded agent along its path with kinematic_state commands. The road user in front is the first box
/// that the agent's box would touch on the next look_ahead_m of the path. An agent continues from its current position
/// and speed, and stops at the end of its path. Along lanes, the desired speed is at most the lane's speed limit. Stop
/// lines are standing obstacles if their light is red, or if it is yellow and the agent can still brake. Pedestrians
/// without a record stand still.
class IdmController final : public Controller {
 public:
  explicit IdmController(const Simulator& simulator, IdmPaths paths = IdmPaths::logged,
                         const IdmParameters& parameters = {});
  std::string_view name() const override { return wanted_paths_ == IdmPaths::lanes ? "idm_lanes" : "idm"; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  struct Front {
    float gap_m = INFINITY, speed_mps = 0;
  };

  float place_on_path(const SimulatorArrays& input, size_t slot);
  Front box_ahead(const SimulatorArrays& input, size_t slot, float s_m) const;
  float closed_line_ahead_m(const SimulatorArrays& input, size_t slot, float s_m) const;
  Command command_of(const SimulatorArrays& input, size_t slot);

  IdmPaths wanted_paths_;
  IdmParameters parameters_;
  float dt_s_;
  std::vector<std::shared_ptr<const CompiledMap>> maps_;  // keeps the arrays of views_ alive
  std::vector<MapView> views_;                            // [worlds]
  std::vector<FollowedPath> paths_;                       // [slots]
  std::vector<uint8_t> on_lanes_;                         // [slots] whether the agent's path is along lanes
  std::vector<float> progress_m_;                         // [slots] progress along the path at the last act()
  std::vector<int32_t> life_;                             // [slots] life of the agent at the last act()
};

}  // namespace pictura
