// Controller that combines several controllers of one simulator, each of which commands its own slots.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// A controller and the slots that it commands: those with a nonzero element of mask [slots], or all slots if the mask
/// is empty.
struct Driver {
  std::unique_ptr<Controller> controller;
  Span<const uint8_t> mask;                 // in the memory of the simulator's device
  std::shared_ptr<const void> mask_memory;  // owner of the mask's memory, if any
};

/// Makes a driver with a mask on the host.
Driver driver_of(std::unique_ptr<Controller> controller, std::vector<uint8_t> mask);

/// Calls all drivers in their order. If two drivers command a slot, the command of the later driver prevails. A CUDA
/// graph can capture act() if it can capture the act() of every driver. The mask of act() must be empty if a driver has
/// a mask.
class SharedControl final : public Controller {
 public:
  /// Throws UsageError for an empty list of drivers.
  explicit SharedControl(std::vector<Driver> drivers);

  /// Names of the drivers, separated by commas.
  std::string_view name() const override { return name_; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  std::vector<Driver> drivers_;
  std::string name_;
};

}  // namespace pictura
