// Computations of a policy besides its network: selecting agents, choosing their actions, and writing commands. The
// executors of the host and of CUDA devices give the same bits.
#pragma once

#include "pictura/common/array.h"
#include "pictura/policy/rules/choose_action.h"

namespace pictura {

/// Interface of executors. Only one thread may use an executor at a time. All arrays are in the memory of device(). On
/// a CUDA device, work is enqueued on the stream, and only functions that return a number wait for the stream.
class PolicyExecutor {
 public:
  PolicyExecutor() = default;
  virtual ~PolicyExecutor() = default;
  PolicyExecutor(const PolicyExecutor&) = delete;
  PolicyExecutor& operator=(const PolicyExecutor&) = delete;

  virtual Device device() const = 0;
  /// Memory available for computations: on a device, the free memory; on the host, all memory, because file caches can
  /// be freed.
  virtual int64_t memory_bytes() const = 0;

  /// Writes to slots_out, in ascending order, the slots for which asked(slot) is true. Returns their number. slots_out
  /// must have room for all slots of the simulator.
  virtual int64_t select_deciding(const DecidingSlots& asked, Span<int64_t> slots_out, Stream stream = {}) = 0;
  /// Chooses the actions of `slots`. log_probs: [slots.size(), kNumActions]; actions_out: [all slots of the simulator],
  /// in which actions of other slots remain unchanged.
  virtual void choose_actions(const SimulatorArrays& input, Span<const int64_t> slots, Span<const float> log_probs,
                              const ActionChoice& choice, Span<int32_t> actions_out, Stream stream = {}) = 0;
  /// Writes commands with these actions for slots whose element of the mask is not 0 (empty mask: all slots). All
  /// arrays are [slots].
  virtual void write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Span<Command> commands_out,
                              Stream stream = {}) = 0;
};

}  // namespace pictura
