// The intelligent driver model along recorded paths: traffic that goes where it went, and stops behind what is in its
// way. On the host only.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/simulator/controllers/controller.h"
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

/// Where a track went: its recorded places, each at least kMinPiece_m from the one before.
struct RecordedPath {
  static constexpr float kMinPiece_m = 0.5f;
  std::vector<Vec3> points_m;      // reference points
  std::vector<float> heading_rad;  // as recorded there
  std::vector<float> s_m;          // along it

  float length_m() const { return s_m.back(); }
  /// The place nearest to p on the pieces from `from_s_m` on, or that end just before it.
  float nearest_m(Vec2 p, float from_s_m) const;
  struct Pose {
    Vec3 position_m;
    float heading_rad = 0;
  };
  Pose at(float s_m) const;
};

/// Puts every agent that it commands farther along its recorded path, by kinematic states: at the speed of the model
/// behind the first box that its own touches within look_ahead_m of the path. At the end of the path it stops. It
/// starts from where the agent is and at its speed.
class IdmController final : public Controller {
 public:
  /// Of one simulator, whose worlds are all recorded scenes.
  explicit IdmController(const Simulator& simulator, const IdmParameters& parameters = {});
  std::string_view name() const override { return "idm"; }
  void act(const ControllerInput& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  Command command_of(const ControllerInput& input, size_t slot);

  IdmParameters parameters_;
  float dt_s_;
  std::vector<RecordedPath> paths_;  // [slots]
  std::vector<float> progress_m_;    // [slots] at the last act(), where the next one looks for the agent
};

}  // namespace pictura
