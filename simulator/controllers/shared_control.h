// Several controllers that share a simulator's worlds, each for its own slots.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// A controller and the slots that it commands: all, or those whose mask [slots] is not 0.
struct Driver {
  std::unique_ptr<Controller> controller;
  Span<const uint8_t> mask;                 // in the simulator's memory
  std::shared_ptr<const void> mask_memory;  // what holds it, if anything must
};

/// With a mask on the host.
Driver driver_of(std::unique_ptr<Controller> controller, std::vector<uint8_t> mask);

/// Lets all drivers command in their order: of two that command a slot, the later one drives. It is captured in graphs
/// as they are. The mask of act() leaves out more slots; it must be empty where drivers have masks of their own.
class SharedControl final : public Controller {
 public:
  /// Throws UsageError where there is no driver.
  explicit SharedControl(std::vector<Driver> drivers);

  /// Their names, with commas between them.
  std::string_view name() const override { return name_; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  std::vector<Driver> drivers_;
  std::string name_;
};

}  // namespace pictura
