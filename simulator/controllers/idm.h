// The intelligent driver model along recorded paths, or along lanes: traffic that goes where it went, or where its
// lanes lead, and stops behind what is in its way. On the host only.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/rules/map_view.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Treiber, Hennecke and Helbing, Congested traffic states in empirical observations and microscopic simulations
/// (2000); the values are those of Waymax' agents that follow waypoints.
struct IdmParameters {
  float wanted_mps = 30;
  float min_gap_m = 2;
  float headway_s = 2;
  float accel_mps2 = 2, brake_mps2 = 4;
  float exponent = 4;
  float look_ahead_m = 10;
};

/// By how much to change the speed, for a gap to the one in front (infinite: nobody) and its speed.
float idm_acceleration(const IdmParameters& parameters, float speed_mps, float gap_m, float front_mps);

/// Where an agent goes: places of its reference point, each at least kMinPiece_m from the one before, and its heading
/// there.
struct FollowedPath {
  static constexpr float kMinPiece_m = 0.5f;
  std::vector<Vec3> points_m;
  std::vector<float> heading_rad;
  std::vector<float> s_m;  // along it
  bool ends = true;        // false: lanes go on beyond it

  /// Adds a place, unless it is too near to the last one.
  void add(Vec3 point_m, float its_heading_rad);
  float length_m() const { return s_m.back(); }
  /// The place nearest to p on the pieces from `from_s_m` on, or that end just before it.
  float nearest_m(Vec2 p, float from_s_m) const;
  struct Pose {
    Vec3 position_m;
    float heading_rad = 0;
  };
  Pose at(float s_m) const;
};

/// From a pose onto the centre line of the lane, and along it and those that follow, at forks the straightest way, for
/// kAhead_m or to where lanes end. Of lanes from which a route goes on for ever, others do not follow. A lane without
/// successors is left for the nearest lane beside it that has some; without room for that, the path ends where the
/// front bumper, front_m ahead of the reference point, is before the lane's end. From no lane (-1) the pose alone.
FollowedPath path_along_lanes(const MapView& map, int32_t lane, Vec3 position_m, float heading_rad, float front_m);

enum class IdmPaths {
  logged,  // recorded ones; where there is no record, as in towns, along lanes
  lanes,   // for vehicles and cyclists, always
};

/// Puts every agent that it commands farther along its path, by kinematic states: at the speed of the model behind the
/// first box that its own touches within look_ahead_m of the path. It starts from where the agent is and at its speed,
/// and stops at the path's end. Along lanes it wants the lane's limit at most, and a line whose light is red, or yellow
/// where it can still brake, is in front of it as a box that stands is. Pedestrians without a record stand.
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
  std::vector<std::shared_ptr<const CompiledMap>> maps_;  // they own what the views show
  std::vector<MapView> views_;                            // [worlds]
  std::vector<FollowedPath> paths_;                       // [slots]
  std::vector<uint8_t> on_lanes_;                         // [slots] whether its path is along lanes
  std::vector<float> progress_m_;                         // [slots] at the last act(), where the next one looks for it
  std::vector<int32_t> life_;                             // [slots] of the agent at the last act()
};

}  // namespace pictura
