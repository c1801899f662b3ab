#include "pictura/bindings/function_controller.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <pybind11/numpy.h>

#include "pictura/bindings/arrays.h"
#include "pictura/common/error.h"
#include "pictura/common/image.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/observation_arrays.h"

namespace pictura::python {

namespace {

using Actions = py::array_t<int32_t, py::array::c_style | py::array::forcecast>;

class FunctionController final : public Controller {
 public:
  FunctionController(std::string name, std::shared_ptr<const py::object> function, Renderer* renderer)
      : name_(std::move(name)), function_(std::move(function)), renderer_(renderer) {}

  std::string_view name() const override { return name_; }

  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name_, input, {}, mask, commands_out);
    std::vector<size_t> drawn;
    std::optional<HostImages> images;
    if (renderer_) {
      drawn = active_slots(input, mask);
      images = draw(input, drawn);
    }
    const py::gil_scoped_acquire gil;
    const int slots = static_cast<int>(commands_out.size());
    py::dict observations = observations_of(input, slots);
    if (images) add_images(*images, drawn, slots, &observations);
    const Actions actions = actions_for(observations, slots);
    for (size_t slot = 0; slot < commands_out.size(); ++slot) {
      if (mask.empty() || mask[slot] != 0) commands_out[slot] = {.action = actions.data()[slot]};
    }
  }

 private:
  static std::vector<size_t> active_slots(const SimulatorArrays& input, Span<const uint8_t> mask) {
    std::vector<size_t> slots;
    for (size_t slot = 0; slot < input.views.size(); ++slot) {
      if (input.state.status[slot] == AgentStatus::active && (mask.empty() || mask[slot] != 0)) slots.push_back(slot);
    }
    return slots;
  }

  HostImages draw(const SimulatorArrays& input, const std::vector<size_t>& slots) const {
    std::vector<View> views;
    for (const size_t slot : slots) views.push_back(input.views[slot]);
    HostImages images(renderer_->config().rig, static_cast<int>(views.size()));
    renderer_->render(input.scene, Span<const View>(views), images.batch());
    return images;
  }

  static void add_images(const HostImages& images, const std::vector<size_t>& drawn, int slots,
                         py::dict* observations) {
    const ImageLayout& layout = images.layout();
    for (size_t i = 0; i < layout.blocks.size(); ++i) {
      const BlockLayout& block = layout.blocks[i];
      const auto cameras = static_cast<py::ssize_t>(block.cameras.size());
      py::array_t<uint8_t> all({py::ssize_t{slots}, cameras, py::ssize_t{3}, py::ssize_t{block.size.height_px},
                                py::ssize_t{block.size.width_px}});
      const auto bytes_per_view = static_cast<size_t>(cameras * 3 * block.size.pixels());
      std::fill_n(all.mutable_data(), static_cast<size_t>(slots) * bytes_per_view, uint8_t{0});
      for (size_t view = 0; view < drawn.size(); ++view) {
        const uint8_t* const first = images.bytes().data() + block.offset + view * bytes_per_view;
        std::copy_n(first, bytes_per_view, all.mutable_data() + drawn[view] * bytes_per_view);
      }
      (*observations)[py::str(layout.blocks.size() == 1 ? "rgb" : fmt::format("rgb_{}", i))] = all;
    }
  }

  static py::dict observations_of(const SimulatorArrays& input, int slots) {
    // Arrays are copied, because the function may keep them.
    py::dict observations;
    for (const NamedArray& named : observation_arrays(input.observations, slots, input.device)) {
      const Array& array = named.array;
      const py::dtype type = array.type == ElementType::f32 ? py::dtype::of<float>() : py::dtype::of<int32_t>();
      std::vector<py::ssize_t> shape{slots};
      if (array.shape[1] > 1) shape.push_back(array.shape[1]);
      shape.push_back(array.shape[2]);
      observations[py::str(std::string(named.name))] = py::array(type, shape, array.data);
    }
    return observations;
  }

  Actions actions_for(const py::dict& observations, int slots) const {
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
  Renderer* renderer_;
};

}  // namespace

std::string name_of_function(const py::function& function) {
  const py::object named = py::hasattr(function, "__name__") ? py::object(function) : py::type::of(function);
  return "function " + py::cast<std::string>(named.attr("__name__"));
}

std::function<std::unique_ptr<Controller>(const Simulator&, Renderer*)> function_controllers(
    const py::function& function) {
  const auto held = std::make_shared<const py::object>(function);
  return [name = name_of_function(function), held](const Simulator& simulator, Renderer* renderer) {
    PICTURA_CHECK(simulator.device().is_host(), "{}: expected a simulator on cpu, got one on {}", name,
                  name_of(simulator.device()));
    return std::make_unique<FunctionController>(name, held, renderer);
  };
}

}  // namespace pictura::python
