// Opponents: saved policies that drive shares of a run's agents, each from the observations of its training. The
// learner learns nothing from their agents.
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
  /// naming a file if it holds no policy, reads slots of the ego vector that the learner must not have, or holds its
  /// actions for a number of steps that does not divide a rollout.
  Opponents(const Config& config, Device device, Communicator* communicator);
  ~Opponents();
  Opponents(const Opponents&) = delete;
  Opponents& operator=(const Opponents&) = delete;

  /// Adds the arrays that the opponents read to those that a simulator writes.
  void add_arrays(SimulatorConfig* config_inout) const;
  /// Prepares to drive in the run's simulator, which must outlive this object.
  void enter(const Simulator& simulator);

  /// Mask of the agents that the learner drives after the simulator's last step, u8 [slots].
  at::Tensor own_slots(const SimulatorArrays& input) const;
  /// Returns the commands of all agents, [slots]: `own_actions` [slots], replaced by the opponents' draws for their
  /// agents. A later call overwrites the result. On a device waits for the number of agents of each opponent.
  Span<const Command> commands(const SimulatorArrays& input, Span<const int32_t> own_actions, PolicyExecutor* executor);

 private:
  struct Opponent;
  const uint64_t seed_;
  std::vector<std::unique_ptr<Opponent>> opponents_;
  std::unique_ptr<DeviceCopy<Command>> commands_;
};

}  // namespace pictura
