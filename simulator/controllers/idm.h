// Intelligent driver model along recorded paths or along lanes. Traffic follows its path and stops behind obstacles in
// its way. Host only.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/rules/map_view.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Parameters of the model of Treiber, Hennecke and Helbing, Congested traffic states in empirical observations and
/// microscopic simulations (2000). The values are those of Waymax's waypoint-following agents.
struct IdmParameters {
  float wanted_mps = 30;
  float min_gap_m = 2;
  float headway_s = 2;
  float accel_mps2 = 2, brake_mps2 = 4;
  float exponent = 4;
  float look_ahead_m = 10;
};

/// Acceleration for a gap to the road user in front (infinite: none) and the speed of that road user.
float idm_acceleration(const IdmParameters& parameters, float speed_mps, float gap_m, float front_mps);

/// Path of an agent: places of its reference point, each at least kMinPiece_m from the previous place, with headings.
struct FollowedPath {
  static constexpr float kMinPiece_m = 0.5f;
  std::vector<Vec3> points_m;
  std::vector<float> heading_rad;
  std::vector<float> s_m;  // arc length along the path
  bool ends = true;        // false: lanes continue beyond the path

  /// Adds a place, unless it is too near to the last place.
  void add(Vec3 point_m, float its_heading_rad);
  float length_m() const { return s_m.back(); }
  /// Returns the arc length of the place nearest to p, on the pieces from `from_s_m` on, including a piece that ends
  /// just before `from_s_m`.
  float nearest_m(Vec2 p, float from_s_m) const;
  struct Pose {
    Vec3 position_m;
    float heading_rad = 0;
  };
  Pose at(float s_m) const;
};

/// Returns a path from a pose onto the centre line of the lane and along the lanes that follow, for kAhead_m or to the
/// end of the lanes. The path takes the straightest way at forks. After endless lanes, only endless lanes follow. At a
/// lane without successors, the path changes to the nearest lane beside it with successors. If there is no room for the
/// change, the path ends where the front bumper, front_m ahead of the reference point, is before the lane's end.
/// Without a lane (-1), the path is the pose alone.
FollowedPath path_along_lanes(const MapView& map, int32_t lane, Vec3 position_m, float heading_rad, float front_m);

enum class IdmPaths {
  logged,  // recorded paths; without a record, as in towns, along lanes
  lanes,   // along lanes for all vehicles and cyclists
};

/// Moves every commanded agent along its path by kinematic states. The speed follows the model behind the first box
/// that the agent's box would touch within look_ahead_m of the path. The motion starts from the agent's current place
/// and speed, and stops at the path's end. Along lanes, the lane's limit bounds the desired speed. A line with a red
/// light, or with a yellow light before which the agent can still brake, counts as a standing box. Pedestrians without
/// a record stand still.
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
  std::vector<std::shared_ptr<const CompiledMap>> maps_;  // own the arrays of the views
  std::vector<MapView> views_;                            // [worlds]
  std::vector<FollowedPath> paths_;                       // [slots]
  std::vector<uint8_t> on_lanes_;                         // [slots] whether the agent's path is along lanes
  std::vector<float> progress_m_;                         // [slots] at the last act(); the next search starts there
  std::vector<int32_t> life_;                             // [slots] life of the agent at the last act()
};

}  // namespace pictura
