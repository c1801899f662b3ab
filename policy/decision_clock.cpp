#include "pictura/policy/decision_clock.h"

#include "pictura/policy/torch_device.h"

namespace pictura {

namespace {

// Returns, for each slot, the element of an array [worlds] for the slot's world.
template <typename T>
at::Tensor values_of_slots(const SimulatorArrays& input, Span<const T> of_worlds) {
  const auto num_slots = static_cast<int64_t>(input.slots.world_of_slot.size());
  return tensor_over(of_worlds, input.device, {static_cast<int64_t>(of_worlds.size())})
      .index_select(0, tensor_over(input.slots.world_of_slot, input.device, {num_slots}));
}

}  // namespace

at::Tensor DecisionClock::select_deciding(const SimulatorArrays& input, const at::Tensor& active, int64_t step,
                                          Span<const uint8_t> episode_over) {
  if (decision_steps_ == 1) return active;
  const auto num_slots = static_cast<int64_t>(input.slots.world_of_slot.size());
  const at::Tensor acted_before = acted_;
  acted_ = at::zeros({num_slots}, active.options().dtype(at::kByte)).index_fill_(0, active, 1);
  if (step % decision_steps_ == 0 || !acted_before.defined() || acted_before.size(0) != num_slots) return active;
  const at::Tensor life_step = tensor_over(Span<const int32_t>(input.state.life_step, static_cast<size_t>(num_slots)),
                                           input.device, {num_slots});
  const at::Tensor left =
      tensor_over(Span<const uint8_t>(input.state.left, static_cast<size_t>(num_slots)), input.device, {num_slots});
  at::Tensor decides = (acted_before == 0).logical_or_(values_of_slots(input, input.episode_step) == life_step);
  decides.logical_or_(left);
  if (!episode_over.empty()) decides.logical_or_(values_of_slots(input, episode_over));
  return active.index_select(0, at::nonzero(decides.index_select(0, active)).squeeze(1));
}

}  // namespace pictura
