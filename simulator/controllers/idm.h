// Intelligent driver model (IDM) along recorded paths or lanes. Runs only on the host.
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
/// microscopic simulations, 2000). The values are Waymax's.
struct IdmParameters {
  float wanted_mps = 30;
  float min_gap_m = 2;
  float headway_s = 2;
  float accel_mps2 = 2, brake_mps2 = 4;
  float exponent = 4;
  float look_ahead_m = 10;
};

/// Acceleration behind a road user that is gap_m ahead and drives at front_mps. An infinite gap means a free road.
float idm_acceleration(const IdmParameters& parameters, float speed_mps, float gap_m, float front_mps);

/// Path of an agent's reference point.
struct FollowedPath {
  static constexpr float kMinPiece_m = 0.5f;
  std::vector<Vec3> points_m;
  std::vector<float> heading_rad;
  std::vector<float> s_m;  // arc length
  bool ends = true;        // false: lanes continue beyond the path

  /// Ignores a position that is less than kMinPiece_m from the last.
  void add(Vec3 point_m, float its_heading_rad);
  float length_m() const { return s_m.back(); }
  /// Arc length of the point nearest to p. The search starts at about from_s_m.
  float nearest_m(Vec2 p, float from_s_m) const;
  struct Pose {
    Vec3 position_m;
    float heading_rad = 0;
  };
  Pose at(float s_m) const;
};

/// Returns a path from a pose to the lane's centre line and along the following lanes, for 200 m or to their end. At a
/// fork, the path takes the straightest successor on which routes may continue, else the straightest of all. At a lane
/// without successors, it changes to the nearest lane beside it with successors. If there is no room for the change,
/// the path ends so that the front bumper stops before the lane's end. The bumper is front_m ahead of the reference
/// point. If `lane` is -1, the path consists only of the pose.
FollowedPath path_along_lanes(const MapView& map, int32_t lane, Vec3 position_m, float heading_rad, float front_m);

enum class IdmPaths {
  logged,  // along recorded paths; on maps without a record, along lanes
  lanes,   // all vehicles and cyclists along lanes
};

/// Moves every commanded agent along its path with kinematic_state commands. An agent keeps its distance from the first
/// box that its own box would touch within look_ahead_m. It stops at the end of its path, at red lights, and at yellow
/// lights if it can still brake. Along lanes, it respects the speed limit. Pedestrians without a record stand still.
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
  std::vector<std::shared_ptr<const CompiledMap>> maps_;  // owns the arrays of views_
  std::vector<MapView> views_;                            // [worlds]
  std::vector<FollowedPath> paths_;                       // [slots]
  std::vector<uint8_t> on_lanes_;                         // [slots]
  std::vector<float> progress_m_;                         // [slots] arc length at the last act()
  std::vector<int32_t> life_;                             // [slots] life at the last act()
};

}  // namespace pictura
