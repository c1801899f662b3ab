// From the simulator's state to the tensors that a policy reads.
#pragma once

#include "pictura/common/renderer.h"
#include "pictura/training/policy.h"

namespace pictura {

/// Makes the renderer that a policy with images needs, holding the simulator's geometries.
std::unique_ptr<Renderer> make_policy_renderer(const Config& config, const Rig& rig, const Simulator& simulator);

/// Name of the simulator's executor for run.backend ("null" is a renderer alone).
std::string simulator_name(const std::string& backend);

/// Slots whose agents are neither halted nor absent, in ascending order.
std::vector<int64_t> active_slots(Simulator& simulator);

class Observer {
 public:
  /// Both must outlive it; without a renderer the observation is the vector one. Throws Error when either is on a
  /// device that this build's torch cannot reach.
  Observer(Simulator* simulator, Renderer* renderer);

  /// Uninitialised storage for `rows` observations of all slots, [rows, slots, ...].
  Observation allocate(int64_t rows) const;

  /// Of one such row.
  double bytes_per_row() const;

  /// Writes what every slot sees now into one row of such storage. Images are drawn in place, those of active agents
  /// alone: nobody learns from what the others see, and theirs are black. (An agent whose episode is cut off is still
  /// active in its final observation, from which its value is bootstrapped.)
  void observe(const Observation& row_out);

  /// Seconds spent drawing so far.
  double render_s() const { return render_s_; }

 private:
  Simulator& simulator_;
  Renderer* renderer_;
  double render_s_ = 0;
};

/// One row of the storage that allocate() returns.
Observation row_of(const Observation& rows, int64_t row);

/// Policy outputs for a whole batch without gradients, `chunk` agents at a time: log-probabilities [batch, actions] and
/// values [batch].
struct Decision {
  at::Tensor log_probs, value;
};
Decision decide(const Policy& policy, const Observation& observation, int64_t chunk);

/// The index at which the cumulative probability first exceeds `uniform` in [0, 1).
int32_t draw_action(Span<const float> log_probs, float uniform);

/// Chooses one action per slot: the most likely one, or a draw keyed by (seed, global world, agent, episode, step).
void choose_actions(const at::Tensor& log_probs, const Simulator& simulator, uint64_t seed, bool argmax,
                    Span<int32_t> actions_out);

}  // namespace pictura
