#include "pictura/simulator/controllers/shared_control.h"

#include <utility>

#include "pictura/common/error.h"

namespace pictura {

Driver driver_of(std::unique_ptr<Controller> controller, std::vector<uint8_t> mask) {
  const auto memory = std::make_shared<const std::vector<uint8_t>>(std::move(mask));
  return {std::move(controller), *memory, memory};
}

SharedControl::SharedControl(std::vector<Driver> drivers) : drivers_(std::move(drivers)) {
  if (drivers_.empty()) fail_usage("shared control: expected at least one controller, got none");
  for (const Driver& driver : drivers_) {
    name_ += name_.empty() ? "" : ", ";
    name_ += driver.controller->name();
  }
}

void SharedControl::act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
                        Stream stream) {
  for (const Driver& driver : drivers_) {
    PICTURA_CHECK(mask.empty() || driver.mask.empty(),
                  "controller {}: expected no mask, since its drivers have their own masks, got a mask of {} slots",
                  name_, mask.size());
    driver.controller->act(input, driver.mask.empty() ? mask : driver.mask, commands_out, stream);
  }
}

}  // namespace pictura
