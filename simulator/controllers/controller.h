// Common interface of everything that commands agents: random and idle controllers, lane keeping, policies, logs.
#pragma once

#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/simulator_arrays.h"

namespace pictura {

/// Chooses a command for every slot. A controller belongs to one simulator and works in that simulator's memory.
class Controller {
 public:
  Controller() = default;
  virtual ~Controller() = default;
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  virtual std::string_view name() const = 0;

  /// Writes commands_out [slots] for the step after the state in `input`. Commands of slots with mask [slots] 0 are
  /// left unchanged, so that controllers can share a simulator; an empty mask commands all slots. Commands of inactive
  /// agents have no meaning. On a device, all arrays lie on the device, and work is put on the stream without waiting
  /// or allocating; a CUDA graph can capture it, unless the name ends in "on the host". On the host the call is
  /// synchronous. Throws Error when an array's size differs from the simulator's number of slots.
  virtual void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
                   Stream stream = {}) = 0;
};

}  // namespace pictura
