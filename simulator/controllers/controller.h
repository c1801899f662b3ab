// Common interface of controllers.
#pragma once

#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/simulator_arrays.h"

namespace pictura {

/// Chooses commands for a simulator, in the memory of its device.
class Controller {
 public:
  Controller() = default;
  virtual ~Controller() = default;
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  virtual std::string_view name() const = 0;

  /// Writes commands_out [slots] for the step after the state in `input`. Only slots with a nonzero element of mask
  /// [slots] change; an empty mask selects all slots. In host memory, the call is synchronous. In device memory, it
  /// puts work on the stream and neither waits nor allocates. A CUDA graph can capture it, unless name() ends in "on
  /// the host". Throws Error for an array of wrong size.
  virtual void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
                   Stream stream = {}) = 0;
};

}  // namespace pictura
