// Opponents: saved policies that drive shares of a run's agents. The learner does not learn from these agents.
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
  /// Reads the policies of simulator.others.policies. Throws Error naming a file that contains no policy. If the
  /// learner reads neither images nor auxiliary slots, throws Error for a vector policy with auxiliary slots. Throws
  /// Error if a policy's decision steps do not divide train.num_steps.
  Opponents(const Config& config, Device device, Communicator* communicator);
  ~Opponents();
  Opponents(const Opponents&) = delete;
  Opponents& operator=(const Opponents&) = delete;

  /// Adds the observation arrays that opponents read.
  void add_arrays(SimulatorConfig* config_inout) const;
  /// Prepares to drive in the run's simulator, which must outlive this object.
  void enter(const Simulator& simulator);

  /// Mask of the agents that the learner now drives, u8 [slots].
  at::Tensor own_slots(const SimulatorArrays& input) const;
  /// Returns the commands of all agents, [slots], valid until the next call. The learner's agents take `own_actions`,
  /// [slots]; opponents draw actions for the others. On a GPU, waits to read the number of each opponent's agents.
  Span<const Command> commands(const SimulatorArrays& input, Span<const int32_t> own_actions, PolicyExecutor* executor);

 private:
  struct Opponent;
  std::vector<std::unique_ptr<Opponent>> opponents_;
  std::unique_ptr<DeviceCopy<Command>> commands_;
};

}  // namespace pictura
