#include "pictura/simulator/simulator.h"

#include "pictura/common/error.h"
#include "pictura/simulator/agent_state_arrays.h"

namespace pictura {

StepResult Simulator::step(const Array& actions, Stream stream) {
  return step_actions(actions.checked<const int32_t>("step: actions", {num_slots()}, device()), stream);
}

void Simulator::reset(const Array& world_mask, uint64_t seed, Stream stream) {
  const auto num_worlds = static_cast<int64_t>(worlds().size());
  reset_worlds(world_mask.checked<const uint8_t>("reset: world_mask", {num_worlds}, device()), seed, stream);
}

void Simulator::set_state(const Array& slots, Span<const NamedArray> fields, Stream stream) {
  apply_edit(state_edit(slots, fields, num_slots(), device()), stream);
}

StepResult Simulator::step(Span<const Command> commands, Stream stream) {
  PICTURA_CHECK(commands.size() == static_cast<size_t>(num_slots()), "step: expected {} commands, got {}", num_slots(),
                commands.size());
  return step_commands(commands, stream);
}

}  // namespace pictura
