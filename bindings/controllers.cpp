// pictura.Controller: named and shared controllers, and their commands.
#include "pictura/backends/make_controller.h"
#include "pictura/bindings/python_simulator.h"
#include "pictura/simulator/controllers/shared_control.h"

namespace pictura::python {

namespace {

/// Controller that forwards to a controller with shared ownership.
class HeldController final : public Controller {
 public:
  explicit HeldController(std::shared_ptr<Controller> held) : held_(std::move(held)) {}
  std::string_view name() const override { return held_->name(); }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    held_->act(input, mask, commands_out, stream);
  }

 private:
  std::shared_ptr<Controller> held_;
};

/// Creates a controller that combines several controllers, each with a mask of its slots. None means all slots.
ControllerInside shared_controller(const std::vector<std::pair<PyController*, py::object>>& drivers,
                                   const PySimulator& simulator) {
  std::vector<Driver> driving;
  for (const auto& [controller, mask] : drivers) {
    PICTURA_CHECK(controller, "Controller.shared: expected a controller, got None");
    const ControllerInside& inside = controller->inside();
    PICTURA_CHECK(inside.of == simulator.shared(), "Controller.shared: expected controllers of this simulator");
    Driver driver{.controller = std::make_unique<HeldController>(inside.controller)};
    if (!mask.is_none()) {
      const std::string what = "Controller.shared: mask of '" + controller->name() + "'";
      const auto borrowed = std::make_shared<BorrowedArray>(borrow(mask, what, simulator.stream()));
      driver.mask = borrowed->array().checked<const uint8_t>(what, {inside.of->num_slots()}, inside.of->device());
      driver.mask_memory = borrowed;
    }
    driving.push_back(std::move(driver));
  }
  return {simulator.shared(), std::make_shared<SharedControl>(std::move(driving))};
}

ControllerInside controller_by_name(const std::string& name, const PySimulator& simulator, uint64_t seed) {
  const std::shared_ptr<Simulator>& of = simulator.shared();
  PICTURA_CHECK(of->device().is_host(), "Controller: expected a simulator on cpu, got one on {}",
                name_of(of->device()));
  return {of, make_controller(name, *of, seed)};
}

}  // namespace

void define_controller(py::class_<PyController>* controller) {
  (*controller)
      .def(py::init([](const std::string& name, const PySimulator& simulator, uint64_t seed) {
             return std::make_unique<PyController>(controller_by_name(name, simulator, seed));
           }),
           py::arg("name"), py::arg("simulator"), py::arg("seed") = 0,
           "Raises pictura.UsageError, which lists the valid names, if `name` is unknown.")
      .def_static(
          "_of", [](const ControllerInside& inside) { return std::make_unique<PyController>(inside); },
          py::arg("inside"))
      .def_static(
          "shared",
          [](const std::vector<std::pair<PyController*, py::object>>& drivers, const PySimulator& simulator) {
            return std::make_unique<PyController>(shared_controller(drivers, simulator));
          },
          py::arg("drivers"), py::arg("simulator"),
          R"(Returns a controller that combines several controllers, each for some of a simulator's slots.

drivers: pairs (controller, mask). If two controllers command the same slot, the later one in the list drives.
mask: uint8 or bool [slots] in the simulator's memory, which every step reads; None: all slots.
Raises pictura.Error for a mask of another shape, type or device, and for a controller of another simulator.)")
      .def_property_readonly("name", &PyController::name)
      .def(
          "act",
          [](PyController& self, PySimulator& simulator) {
            simulator.calls().run("act", [&] { self.act(simulator); });
            return self.lent_commands(simulator.stream());
          },
          py::arg("simulator"),
          R"(Returns commands for all slots: a NumPy array of COMMAND_DTYPE [slots], or uint8 [slots, 28] on CUDA. The caller may
change them before step_commands() executes them. Every call returns the same memory.)");
}

}  // namespace pictura::python
