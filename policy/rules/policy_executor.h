// Executor of a policy's computations besides its network.
#pragma once

#include "pictura/common/array.h"
#include "pictura/policy/rules/choose_action.h"

namespace pictura {

/// Interface of executors, which compute the same bits on hosts and CUDA devices. Only one thread at a time may use an
/// executor. All arrays are on device(). Functions enqueue work on the stream; those that return a number wait.
class PolicyExecutor {
 public:
  PolicyExecutor() = default;
  virtual ~PolicyExecutor() = default;
  PolicyExecutor(const PolicyExecutor&) = delete;
  PolicyExecutor& operator=(const PolicyExecutor&) = delete;

  virtual Device device() const = 0;
  /// On a device: free memory. On the host: all memory, because free memory would exclude file caches, which can be
  /// freed.
  virtual int64_t memory_bytes() const = 0;

  /// Writes the slots for which asked(slot) is true, ascending, and returns their number. slots_out has room for all
  /// slots.
  virtual int64_t select_deciding(const DecidingSlots& asked, Span<int64_t> slots_out, Stream stream = {}) = 0;
  /// Chooses the actions of `slots`. log_probs: [slots.size(), kNumActions]; actions_out: [all slots]; others stay
  /// unchanged.
  virtual void choose_actions(const SimulatorArrays& input, Span<const int64_t> slots, Span<const float> log_probs,
                              const ActionChoice& choice, Span<int32_t> actions_out, Stream stream = {}) = 0;
  /// Writes commands for slots with a nonzero mask (empty: all slots). All arrays are [slots].
  virtual void write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Span<Command> commands_out,
                              Stream stream = {}) = 0;
};

}  // namespace pictura
