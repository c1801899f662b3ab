#include "pictura/simulator/simulator.h"

#include "pictura/common/error.h"

namespace pictura {

StepResult Simulator::step(const Array& actions, Stream stream) {
  return step_actions(actions.checked<const int32_t>("step: actions", {num_slots()}, device()), stream);
}

StepResult Simulator::step(Span<const Command> commands, Stream stream) {
  PICTURA_CHECK(commands.size() == static_cast<size_t>(num_slots()), "step: expected {} commands, got {}", num_slots(),
                commands.size());
  return step_commands(commands, stream);
}

}  // namespace pictura
