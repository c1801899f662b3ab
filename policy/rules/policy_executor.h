// What a policy does besides its network: who is asked, what each chooses, and the commands. Executors for the host and
// for CUDA devices give the same bits.
#pragma once

#include "pictura/common/array.h"
#include "pictura/policy/rules/choose_action.h"

namespace pictura {

/// An executor serves one thread at a time. On a device all arrays lie there, work is put on the stream, and only what
/// returns a count waits for it.
class PolicyExecutor {
 public:
  PolicyExecutor() = default;
  virtual ~PolicyExecutor() = default;
  PolicyExecutor(const PolicyExecutor&) = delete;
  PolicyExecutor& operator=(const PolicyExecutor&) = delete;

  virtual Device device() const = 0;
  /// Memory that work may use: on a device what is free; on the host all, since memory that caches files can be freed.
  virtual int64_t memory_bytes() const = 0;

  /// The asked slots in ascending order. slots_out [slots] has room for all. Returns their number.
  virtual int64_t select_asked(const AskedSlots& asked, Span<int64_t> slots_out, Stream stream = {}) = 0;
  /// Chooses the actions of some slots. log_probs: [slots.size(), kNumActions]; actions_out: [slots of the simulator],
  /// of which those of all others stay as they are.
  virtual void choose_actions(const SimulatorArrays& input, Span<const int64_t> slots, Span<const float> log_probs,
                              const ActionChoice& choice, Span<int32_t> actions_out, Stream stream = {}) = 0;
  /// Writes commands with these actions for the slots that the mask has (empty: all). All are [slots].
  virtual void write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Span<Command> commands_out,
                              Stream stream = {}) = 0;
};

}  // namespace pictura
