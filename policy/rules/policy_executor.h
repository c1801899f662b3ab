// Work of a policy outside its network: selecting the agents that decide, choosing their actions, and writing commands.
// Executors for the host and for CUDA devices give the same bits.
#pragma once

#include "pictura/common/array.h"
#include "pictura/policy/rules/choose_action.h"

namespace pictura {

/// Executor, which serves one thread at a time. On a device all arrays are in its memory and work is enqueued on the
/// stream. Only functions that return a count wait for the stream.
class PolicyExecutor {
 public:
  PolicyExecutor() = default;
  virtual ~PolicyExecutor() = default;
  PolicyExecutor(const PolicyExecutor&) = delete;
  PolicyExecutor& operator=(const PolicyExecutor&) = delete;

  virtual Device device() const = 0;
  /// Memory that work may use: on a device the free memory; on the host all memory, since file caches can be freed.
  virtual int64_t memory_bytes() const = 0;

  /// Writes the slots that `asked` selects to slots_out in ascending order, and returns their number. slots_out must
  /// have room for all slots.
  virtual int64_t select_deciding(const DecidingSlots& asked, Span<int64_t> slots_out, Stream stream = {}) = 0;
  /// Chooses the actions of `slots`. log_probs: [slots.size(), kNumActions]; actions_out: [slots of the simulator],
  /// where actions of other slots remain unchanged.
  virtual void choose_actions(const SimulatorArrays& input, Span<const int64_t> slots, Span<const float> log_probs,
                              const ActionChoice& choice, Span<int32_t> actions_out, Stream stream = {}) = 0;
  /// Writes commands with these actions for the slots that the mask selects (empty: all). All arrays are [slots].
  virtual void write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Span<Command> commands_out,
                              Stream stream = {}) = 0;
};

}  // namespace pictura
