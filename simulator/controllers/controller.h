// Common interface of controllers (random, idle, lane keeping, policies, recordings), which command agents.
#pragma once

#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/simulator_arrays.h"

namespace pictura {

/// Chooses a command for every slot. A controller belongs to one simulator and works in the memory of the simulator's
/// device.
class Controller {
 public:
  Controller() = default;
  virtual ~Controller() = default;
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  virtual std::string_view name() const = 0;

  /// Writes commands_out [slots] for the step that follows the state in `input`. Commands of slots whose element of
  /// mask [slots] is 0 stay unchanged, so that several controllers can share a simulator; an empty mask selects all
  /// slots. Inactive agents obey at most the command `recorded`; see Command. In host memory, the call is synchronous.
  /// In device memory, the call puts work on the stream and neither waits nor allocates. A CUDA graph can then capture
  /// it, unless name() ends in "on the host". Throws Error if the size of an array differs from the simulator's number
  /// of slots.
  virtual void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
                   Stream stream = {}) = 0;
};

}  // namespace pictura
