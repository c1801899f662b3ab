// Executor of a learner on the host: the rules of learning as plain loops.
#include <algorithm>
#include <memory>
#include <vector>

#include <unistd.h>

#include "pictura/policy/rules/choose_action.h"
#include "pictura/training/rules/advantage_filter.h"
#include "pictura/training/rules/learner_executor.h"

namespace pictura {

std::unique_ptr<LearnerExecutor> make_cpu_learner_executor();

namespace {

class LearnerExecutorCpu final : public LearnerExecutor {
 public:
  Device device() const override { return {}; }
  int64_t memory_bytes() const override { return int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE); }

  int64_t select_deciding(const DecidingSlots& asked, Span<int64_t> slots_out, Stream) override {
    return select(static_cast<int64_t>(slots_out.size()), slots_out, asked);
  }

  void choose_actions(const SimulatorArrays& input, Span<const int64_t> slots, Span<const float> log_probs,
                      const ActionChoice& choice, Span<int32_t> actions_out, Stream) override {
    const ActionRule rule(input, choice);
    for (size_t i = 0; i < slots.size(); ++i) {
      actions_out[slots[i]] = rule(slots[i], log_probs.data() + i * kNumActions);
    }
  }

  void write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Span<Command> commands_out,
                      Stream) override {
    for (size_t slot = 0; slot < commands_out.size(); ++slot) {
      write_command(actions.data(), mask, static_cast<int64_t>(slot), commands_out.data());
    }
  }

  void compute_advantages(const TransitionArrays& transitions, float gamma, float gae_lambda,
                          Span<float> advantages_out, Stream) override {
    // Steps are iterated backwards and slots forwards, so that the inner loop runs over consecutive memory.
    std::vector<GaeTail> tails;
    for (int64_t slot = 0; slot < transitions.num_slots; ++slot) tails.push_back(transitions.tail(slot));
    for (int64_t step = transitions.num_steps - 1; step >= 0; --step) {
      float* const of_step = advantages_out.data() + step * transitions.num_slots;
      for (int64_t slot = 0; slot < transitions.num_slots; ++slot) {
        of_step[slot] = gae_advantage(transitions.at(step, slot), gamma, gae_lambda, &tails[slot]);
      }
    }
  }

  void count_advantages(Span<const float> advantages, Span<const uint8_t> valid, Span<int64_t> counts_inout,
                        Stream) override {
    for (size_t i = 0; i < advantages.size(); ++i) {
      if (valid[i] != 0) ++counts_inout[filter_bin(advantages[i])];
    }
  }

  int64_t select_kept(Span<const float> advantages, Span<const uint8_t> valid, float threshold, Span<int64_t> kept_out,
                      Stream) override {
    return select(static_cast<int64_t>(advantages.size()), kept_out, [&](int64_t i) {
      const auto at = static_cast<size_t>(i);
      return filter_keeps(advantages[at], valid[at] != 0, threshold);
    });
  }

  void permute(const Permutation& permutation, Span<const int64_t> items, Span<int64_t> items_out, Stream) override {
    for (size_t i = 0; i < items.size(); ++i) {
      items_out[i] = items[permutation(static_cast<int64_t>(i))];
    }
  }

 private:
  template <typename Keeps>
  static int64_t select(int64_t count, Span<int64_t> items_out, const Keeps& keeps) {
    int64_t* end = items_out.begin();
    for (int64_t i = 0; i < count; ++i) {
      if (keeps(i)) *end++ = i;
    }
    return end - items_out.begin();
  }
};

}  // namespace

std::unique_ptr<LearnerExecutor> make_cpu_learner_executor() { return std::make_unique<LearnerExecutorCpu>(); }

}  // namespace pictura
