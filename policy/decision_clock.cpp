#include "pictura/policy/decision_clock.h"

#include "pictura/policy/observation.h"
#include "pictura/policy/torch_device.h"

namespace pictura {

at::Tensor DecisionClock::select_deciding(const SimulatorArrays& input, const at::Tensor& active, int64_t step,
                                          bool decides_at_end, PolicyExecutor* executor) {
  if (decision_steps_ == 1) return active;
  const auto num_slots = static_cast<int64_t>(input.slots.world_of_slot.size());
  const at::Tensor acted_before = acted_;
  acted_ = at::zeros({num_slots}, active.options().dtype(at::kByte)).index_fill_(0, active, 1);
  const auto num_acted = static_cast<size_t>(acted_before.defined() ? acted_before.size(0) : 0);
  if (all_decide(step, decision_steps_, num_acted, static_cast<size_t>(num_slots))) return active;
  const HeldActions held(input, acted_before.data_ptr<uint8_t>(), decides_at_end);
  return deciding_slots(input, {input.state.status, span_of<const uint8_t>(acted_), input.state.left, held}, executor);
}

}  // namespace pictura
