// Recorded states of all agents of driven scenes. From any state, a policy can drive one agent while the others are
// replayed.
#pragma once

#include <map>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

struct DrivenState {
  Vec3 position_m;  // reference point
  float heading_rad = 0, speed_mps = 0;
  int32_t lane = -1;
  AgentStatus status = AgentStatus::absent;
};

/// States of a scene until its last step, or until all agents have halted.
struct DrivenScene {
  WorldSpec world;
  int driver = 0;                   // index of the scene's driver
  std::vector<AgentBox> bodies;     // [agents] initial boxes
  std::vector<float> ahead_m;       // [agents] distance of the box's centre ahead of the reference point
  std::vector<DrivenState> states;  // [steps, agents]

  /// Returns the state after `step` steps; the last state for later steps.
  const DrivenState& at(int step, int32_t agent) const;
  AgentBox box_at(int step, int32_t agent) const;
  /// Writes the commands [agents] that place all agents in their states after `step` steps.
  void command_places(int step, Command* commands_out) const;
};

class DrivenScenes {
 public:
  /// Adds the current states of all worlds.
  void add(Simulator& simulator, int driver);
  /// scene: scenario number.
  const DrivenScene& of(int32_t scene) const { return scenes_.at(scene); }

 private:
  std::map<int32_t, DrivenScene> scenes_;
};

}  // namespace pictura
