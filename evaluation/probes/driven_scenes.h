// Where all agents of driven scenes were, state by state, so that some can be put there again while another one drives.
#pragma once

#include <map>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// An agent in one state.
struct DrivenState {
  Vec3 position_m;  // of its reference point
  float heading_rad = 0, speed_mps = 0;
  int32_t lane = -1;
  AgentStatus status = AgentStatus::absent;
};

/// A scene up to its last step, or to where all of its agents had halted.
struct DrivenScene {
  WorldSpec world;
  int driver = 0;                   // who drove it
  std::vector<AgentBox> bodies;     // [agents] as they were at first
  std::vector<float> ahead_m;       // [agents] how far the box's centre is ahead of the reference point
  std::vector<DrivenState> states;  // [steps, agents]

  /// After so many steps; beyond the last state it stays as it is.
  const DrivenState& at(int step, int32_t agent) const;
  AgentBox box_at(int step, int32_t agent) const;
  /// What puts all agents where they were after so many steps; commands_out: [agents].
  void command_places(int step, Command* commands_out) const;
};

class DrivenScenes {
 public:
  /// Adds the present states of all worlds.
  void add(Simulator& simulator, int driver);
  /// By the number of its scenario.
  const DrivenScene& of(int32_t scene) const { return scenes_.at(scene); }

 private:
  std::map<int32_t, DrivenScene> scenes_;
};

}  // namespace pictura
