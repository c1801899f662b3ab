// Who drives: the one interface of everything that commands agents (random, idle, lane keeping, policies, logs).
#pragma once

#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/simulator_arrays.h"

namespace pictura {

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
  virtual void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
                   Stream stream = {}) = 0;
};

}  // namespace pictura
