#include "pictura/bindings/function_controller.h"

#include <utility>

#include <pybind11/numpy.h>

#include "pictura/bindings/arrays.h"
#include "pictura/common/error.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/observation_arrays.h"

namespace pictura::python {

namespace {

using Actions = py::array_t<int32_t, py::array::c_style | py::array::forcecast>;

class FunctionController final : public Controller {
 public:
  FunctionController(std::string name, std::shared_ptr<const py::object> function)
      : name_(std::move(name)), function_(std::move(function)) {}

  std::string_view name() const override { return name_; }

  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name_, input, {}, mask, commands_out);
    const py::gil_scoped_acquire gil;
    const Actions actions = actions_of(input, static_cast<int>(commands_out.size()));
    for (size_t slot = 0; slot < commands_out.size(); ++slot) {
      if (mask.empty() || mask[slot] != 0) commands_out[slot] = {.action = actions.data()[slot]};
    }
  }

 private:
  Actions actions_of(const SimulatorArrays& input, int slots) const {
    // Copies: the function may keep them.
    py::dict observations;
    for (const NamedArray& named : observation_arrays(input.observations, slots, input.device)) {
      const Array& array = named.array;
      const py::dtype type = array.type == ElementType::f32 ? py::dtype::of<float>() : py::dtype::of<int32_t>();
      std::vector<py::ssize_t> shape{slots};
      if (array.shape[1] > 1) shape.push_back(array.shape[1]);
      shape.push_back(array.shape[2]);
      observations[py::str(std::string(named.name))] = py::array(type, shape, array.data);
    }
    const py::object result = (*function_)(observations);
    const py::array given = py::array::ensure(result);
    if (!given) PyErr_Clear();
    const bool is_one_a_slot = given && given.ndim() == 1 && given.shape(0) == slots;
    if (!is_one_a_slot || (given.dtype().kind() != 'i' && given.dtype().kind() != 'u')) {
      fail_usage("{}: expected actions, integers [{}], got {}", name_, slots,
                 given ? fmt::format("{} {}", py::cast<std::string>(py::str(given.dtype())),
                                     py::cast<std::string>(py::str(given.attr("shape"))))
                       : type_name_of(result));
    }
    const Actions actions(given);
    for (int slot = 0; slot < slots; ++slot) {
      const int32_t action = actions.data()[slot];
      if (action >= 0 && action < kNumActions) continue;
      fail_usage("{}: expected actions in [0, {}), got {} for slot {}", name_, kNumActions, action, slot);
    }
    return actions;
  }

  std::string name_;
  std::shared_ptr<const py::object> function_;
};

}  // namespace

std::string name_of_function(const py::function& function) {
  const py::object named = py::hasattr(function, "__name__") ? py::object(function) : py::type::of(function);
  return "function " + py::cast<std::string>(named.attr("__name__"));
}

std::function<std::unique_ptr<Controller>(const Simulator&)> function_controllers(const py::function& function) {
  const auto held = std::make_shared<const py::object>(function);
  return [name = name_of_function(function), held](const Simulator& simulator) {
    PICTURA_CHECK(simulator.device().is_host(), "{}: expected a simulator on cpu, got one on {}", name,
                  name_of(simulator.device()));
    return std::make_unique<FunctionController>(name, held);
  };
}

}  // namespace pictura::python
