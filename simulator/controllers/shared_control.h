// Combination of several controllers of one simulator.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// A controller and the slots that it commands. An empty mask [slots] selects all slots.
struct Driver {
  std::unique_ptr<Controller> controller;
  Span<const uint8_t> mask;                 // in the memory of the simulator's device
  std::shared_ptr<const void> mask_memory;  // owner of the mask's memory, or null
};

/// Makes a driver with a mask on the host.
Driver driver_of(std::unique_ptr<Controller> controller, std::vector<uint8_t> mask);

/// Calls all drivers in order. If two drivers command a slot, the later command prevails. A CUDA graph can capture
/// act() if it can capture each driver's act(). The mask of act() must be empty if a driver has a mask.
class SharedControl final : public Controller {
 public:
  /// Throws UsageError for an empty list of drivers.
  explicit SharedControl(std::vector<Driver> drivers);

  std::string_view name() const override { return name_; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  std::vector<Driver> drivers_;
  std::string name_;
};

}  // namespace pictura
