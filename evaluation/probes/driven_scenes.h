// Recorded states of all agents of driven scenes. From any of these states, all agents but one can be replayed while a
// policy drives that one agent.
#pragma once

#include <map>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// State of an agent at one step.
struct DrivenState {
  Vec3 position_m;  // position of the agent's reference point
  float heading_rad = 0, speed_mps = 0;
  int32_t lane = -1;
  AgentStatus status = AgentStatus::absent;
};

/// States of a scene up to its last step, or up to the step at which all of its agents had halted.
struct DrivenScene {
  WorldSpec world;
  int driver = 0;                   // index of the scene's driver
  std::vector<AgentBox> bodies;     // [agents] initial boxes
  std::vector<float> ahead_m;       // [agents] distance of the box's centre ahead of the reference point
  std::vector<DrivenState> states;  // [steps, agents]

  /// Returns an agent's state after `step` steps; the last state for later steps.
  const DrivenState& at(int step, int32_t agent) const;
  AgentBox box_at(int step, int32_t agent) const;
  /// Writes the commands that place all agents in their states after `step` steps; commands_out: [agents].
  void command_places(int step, Command* commands_out) const;
};

class DrivenScenes {
 public:
  /// Adds the current states of all worlds.
  void add(Simulator& simulator, int driver);
  /// Returns the scene of a scenario number.
  const DrivenScene& of(int32_t scene) const { return scenes_.at(scene); }

 private:
  std::map<int32_t, DrivenScene> scenes_;
};

}  // namespace pictura
