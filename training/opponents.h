// Opponents: saved policies that drive shares of a run's agents. Each opponent reads the observations with which it was
// trained. The learner does not learn from the agents of opponents.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/policy/learning_device.h"
#include "pictura/policy/rules/policy_executor.h"
#include "pictura/policy/session.h"
#include "pictura/training/ranks/communicator.h"

namespace pictura {

class Opponents {
 public:
  /// Creates the opponents of simulator.others.policies, on `device`, with the precision of the run. Throws Error
  /// naming a file if it contains no policy, or if its policy reads auxiliary slots (observed numbers that no image
  /// shows) that the learner must not have. Also throws if its policy repeats an action for a number of steps that does
  /// not divide train.num_steps.
  Opponents(const Config& config, Device device, Communicator* communicator);
  ~Opponents();
  Opponents(const Opponents&) = delete;
  Opponents& operator=(const Opponents&) = delete;

  /// Adds to a simulator's configuration the observation arrays that the opponents read.
  void add_arrays(SimulatorConfig* config_inout) const;
  /// Prepares to drive in the run's simulator, which must outlive this object.
  void enter(const Simulator& simulator);

  /// Returns a mask of the agents that the learner drives in the simulator's current state, u8 [slots].
  at::Tensor own_slots(const SimulatorArrays& input) const;
  /// Returns the commands of all agents, [slots]. The learner's agents take `own_actions`, [slots]; opponents' agents
  /// take actions that the opponents draw. A later call overwrites the result. On a GPU, waits until the host has read
  /// the number of each opponent's agents.
  Span<const Command> commands(const SimulatorArrays& input, Span<const int32_t> own_actions, PolicyExecutor* executor);

 private:
  struct Opponent;
  const uint64_t seed_;
  std::vector<std::unique_ptr<Opponent>> opponents_;
  std::unique_ptr<DeviceCopy<Command>> commands_;
};

}  // namespace pictura
