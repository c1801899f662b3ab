// What a learner does besides its network: the rules of this folder over whole rollouts. Executors for the host and for
// CUDA devices give the same bits.
#pragma once

#include "pictura/common/array.h"
#include "pictura/training/rules/choose_action.h"
#include "pictura/training/rules/gae.h"
#include "pictura/training/rules/permutation.h"

namespace pictura {

/// An executor serves one thread at a time. On a device all arrays lie there, work is put on the stream, and only what
/// returns a count waits for it.
class LearnerExecutor {
 public:
  LearnerExecutor() = default;
  virtual ~LearnerExecutor() = default;
  LearnerExecutor(const LearnerExecutor&) = delete;
  LearnerExecutor& operator=(const LearnerExecutor&) = delete;

  virtual Device device() const = 0;
  /// That can be had: of a device, what is free; of the host, all, since what caches files is as good as free.
  virtual int64_t memory_bytes() const = 0;

  /// The asked slots in ascending order. slots_out [slots] has room for all. Returns their number.
  virtual int64_t select_asked(const AskedSlots& asked, Span<int64_t> slots_out, Stream stream = {}) = 0;
  /// Chooses the actions of some slots. log_probs: [slots.size(), kNumActions]; actions_out: [slots of the simulator],
  /// of which those of all others stay as they are.
  virtual void choose_actions(const ControllerInput& input, Span<const int64_t> slots, Span<const float> log_probs,
                              const ActionChoice& choice, Span<int32_t> actions_out, Stream stream = {}) = 0;
  /// Commands with these actions for the slots that the mask has (empty: all). All are [slots].
  virtual void write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Span<Command> commands_out,
                              Stream stream = {}) = 0;
  /// Generalized advantages, see gae.h. advantages_out: [steps, slots].
  virtual void compute_advantages(const TransitionArrays& transitions, float gamma, float gae_lambda,
                                  Span<float> advantages_out, Stream stream = {}) = 0;
  /// Adds the valid transitions to the bins of their |advantages|, see advantage_filter.h. counts_inout:
  /// [kNumFilterBins].
  virtual void count_advantages(Span<const float> advantages, Span<const uint8_t> valid, Span<int64_t> counts_inout,
                                Stream stream = {}) = 0;
  /// The transitions that the advantage filter keeps, in ascending order, see advantage_filter.h. kept_out has room for
  /// all. Returns their number.
  virtual int64_t select_kept(Span<const float> advantages, Span<const uint8_t> valid, float threshold,
                              Span<int64_t> kept_out, Stream stream = {}) = 0;
  /// items_out[i] = items[permutation(i)].
  virtual void permute(const Permutation& permutation, Span<const int64_t> items, Span<int64_t> items_out,
                       Stream stream = {}) = 0;
};

}  // namespace pictura
