// Several controllers that share a simulator's worlds, each for its own slots.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// A controller and the slots that it commands: all slots, or those with nonzero mask [slots].
struct Driver {
  std::unique_ptr<Controller> controller;
  Span<const uint8_t> mask;                 // in the simulator's memory
  std::shared_ptr<const void> mask_memory;  // owner of the mask's memory, if any
};

/// Makes a driver with a mask on the host.
Driver driver_of(std::unique_ptr<Controller> controller, std::vector<uint8_t> mask);

/// Runs all drivers in their order: if two drivers command a slot, the later one prevails. act() can be captured in
/// graphs if that holds for all drivers. The mask of act() excludes further slots; it must be empty if a driver has a
/// mask of its own.
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
