// Who drives: the one interface of everything that commands agents (random, idle, lane keeping, policies, logs).
#pragma once

#include <string_view>

#include "pictura/common/scene_types.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/slot_table.h"
#include "pictura/simulator/totals.h"

namespace pictura {

/// What a simulator shows its controllers, of the state after its last reset() or step(). Everything lies in its
/// memory, at addresses that last as long as the simulator's.
struct ControllerInput {
  Device device;
  SlotTable slots;
  ObservationView observations;
  SceneBatch scene;
  Span<const View> views;  // [slots]
  AgentStateView state{};
  Span<const int32_t> episode_step, episode_index;  // [worlds]
  Span<const SimulatorTotals> world_totals;         // [worlds]
  Span<const uint64_t> seed;                        // [worlds] of its random numbers
};

/// Chooses a command for every slot. It belongs to one simulator and works in that one's memory.
class Controller {
 public:
  Controller() = default;
  virtual ~Controller() = default;
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  virtual std::string_view name() const = 0;

  /// Writes commands_out [slots] for the step after the state that `input` shows, but where mask [slots] is 0: those
  /// stay as they are, so that controllers can share a simulator; an empty mask commands all. Commands of inactive
  /// agents mean nothing. On a device all lie there, the work is put on the stream without waiting or allocating, and a
  /// CUDA graph can capture it, unless the name ends in "on the host"; on the host it is done on return. Throws Error
  /// when an array is of another size than the simulator's slots.
  virtual void act(const ControllerInput& input, Span<const uint8_t> mask, Span<Command> commands_out,
                   Stream stream = {}) = 0;
};

}  // namespace pictura
