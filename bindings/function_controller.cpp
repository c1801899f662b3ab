#include "pictura/bindings/function_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/ranges.h>
#include <pybind11/numpy.h>

#include "pictura/bindings/arrays.h"
#include "pictura/common/error.h"
#include "pictura/common/image.h"
#include "pictura/policy/host_passes.h"
#include "pictura/policy/rules/choose_action.h"
#include "pictura/policy/session_parts.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/observation_arrays.h"

namespace pictura::python {

namespace {

using Actions = py::array_t<int32_t, py::array::c_style | py::array::forcecast>;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// Function that responds to observations of any batch of agents.
class Function {
 public:
  explicit Function(const py::function& function)
      : name_(name_of_function(function)), function_(std::make_shared<const py::object>(function)) {}

  const std::string& name() const { return name_; }

  /// Writes the logits [agents, kNumActions] and values [agents] that PolicySession::evaluate() defines. `input` is in
  /// host memory; images are drawn if there is a renderer.
  void respond(const PolicyInput& input, Renderer* renderer, Span<float> logits_out, Span<float> values_out) const {
    const int agents = static_cast<int>(values_out.size());
    std::vector<size_t> drawn;
    std::optional<HostImages> images;
    if (renderer) {
      for (size_t i = 0; i < values_out.size(); ++i) {
        if (input.is_drawn.empty() || input.is_drawn[i] != 0) drawn.push_back(i);
      }
      images = draw(input, drawn, renderer);
    }
    const py::gil_scoped_acquire gil;
    py::dict observations = observations_of(input.observations, agents);
    if (images) add_images(*images, drawn, agents, &observations);
    const py::object result = (*function_)(observations);
    if (py::isinstance<py::tuple>(result)) {
      read_logits(result, logits_out, values_out);
    } else {
      read_actions(result, agents, logits_out);
      std::fill(values_out.begin(), values_out.end(), std::numeric_limits<float>::quiet_NaN());
    }
  }

 private:
  static HostImages draw(const PolicyInput& input, const std::vector<size_t>& agents, Renderer* renderer) {
    std::vector<View> views;
    for (const size_t agent : agents) views.push_back(input.views[agent]);
    HostImages images(renderer->config().rig, static_cast<int>(views.size()));
    renderer->render(*input.scene, Span<const View>(views), images.batch());
    return images;
  }

  static void add_images(const HostImages& images, const std::vector<size_t>& drawn, int agents,
                         py::dict* observations) {
    const ImageLayout& layout = images.layout();
    for (size_t i = 0; i < layout.blocks.size(); ++i) {
      const BlockLayout& block = layout.blocks[i];
      const auto cameras = static_cast<py::ssize_t>(block.cameras.size());
      py::array_t<uint8_t> all({py::ssize_t{agents}, cameras, py::ssize_t{3}, py::ssize_t{block.size.height_px},
                                py::ssize_t{block.size.width_px}});
      const auto bytes_per_view = static_cast<size_t>(cameras * 3 * block.size.pixels());
      std::fill_n(all.mutable_data(), static_cast<size_t>(agents) * bytes_per_view, uint8_t{0});
      for (size_t view = 0; view < drawn.size(); ++view) {
        const uint8_t* const first = images.bytes().data() + block.offset + view * bytes_per_view;
        std::copy_n(first, bytes_per_view, all.mutable_data() + drawn[view] * bytes_per_view);
      }
      (*observations)[py::str(layout.blocks.size() == 1 ? "rgb" : fmt::format("rgb_{}", i))] = all;
    }
  }

  static py::dict observations_of(const ObservationView& view, int agents) {
    // Arrays are copied, because the function may keep them.
    py::dict observations;
    for (const NamedArray& named : observation_arrays(view, agents, Device{})) {
      const Array& array = named.array;
      const py::dtype type = array.type == ElementType::f32 ? py::dtype::of<float>() : py::dtype::of<int32_t>();
      std::vector<py::ssize_t> shape{agents};
      if (array.shape[1] > 1) shape.push_back(array.shape[1]);
      shape.push_back(array.shape[2]);
      observations[py::str(std::string(named.name))] = py::array(type, shape, array.data);
    }
    return observations;
  }

  /// Type and shape of a result in messages.
  static std::string text_of(const py::object& result) {
    const py::array array = as_array(result);
    if (!array) return type_name_of(result);
    return fmt::format("{} {}", py::cast<std::string>(py::str(array.dtype())),
                       py::cast<std::string>(py::str(array.attr("shape"))));
  }

  /// Returns a result as an array; null if it is none.
  static py::array as_array(const py::object& result) {
    py::array array = py::array::ensure(result);
    if (!array) PyErr_Clear();
    return array;
  }

  void read_actions(const py::object& result, int agents, Span<float> logits_out) const {
    const py::array given = as_array(result);
    const bool is_one_each = given && given.ndim() == 1 && given.shape(0) == agents;
    if (!is_one_each || (given.dtype().kind() != 'i' && given.dtype().kind() != 'u')) {
      fail_usage("{}: expected actions, integers [{}], got {}", name_, agents, text_of(result));
    }
    const Actions actions(given);
    std::fill(logits_out.begin(), logits_out.end(), -std::numeric_limits<float>::infinity());
    for (int agent = 0; agent < agents; ++agent) {
      const int32_t action = actions.data()[agent];
      if (action < 0 || action >= kNumActions) {
        fail_usage("{}: expected actions in [0, {}), got {} for slot {}", name_, kNumActions, action, agent);
      }
      logits_out[static_cast<size_t>(agent * kNumActions + action)] = 0;
    }
  }

  void read_logits(const py::tuple& result, Span<float> logits_out, Span<float> values_out) const {
    const auto agents = static_cast<py::ssize_t>(values_out.size());
    const auto is_shaped = [](const py::array& array, const std::vector<py::ssize_t>& shape) {
      return array && array.dtype().kind() == 'f' && array.ndim() == static_cast<py::ssize_t>(shape.size()) &&
             std::equal(shape.begin(), shape.end(), array.shape());
    };
    if (result.size() != 2 || !is_shaped(as_array(result[0]), {agents, kNumActions}) ||
        !is_shaped(as_array(result[1]), {agents})) {
      std::vector<std::string> given;
      for (const auto& item : result) given.push_back(text_of(py::reinterpret_borrow<py::object>(item)));
      fail_usage("{}: expected logits, floats [{}, {}], and values, floats [{}], got ({})", name_, agents, kNumActions,
                 agents, fmt::join(given, ", "));
    }
    const Floats logits(as_array(result[0])), values(as_array(result[1]));
    const auto are_finite = [](const Floats& all) {
      return std::all_of(all.data(), all.data() + all.size(), [](float value) { return std::isfinite(value); });
    };
    if (!are_finite(logits) || !are_finite(values)) {
      fail_usage("{}: expected finite logits and values, got infinities or NaN", name_);
    }
    std::copy_n(logits.data(), logits.size(), logits_out.data());
    std::copy_n(values.data(), values.size(), values_out.data());
  }

  std::string name_;
  std::shared_ptr<const py::object> function_;  // shared, because copies are made without the GIL
};

class FunctionController final : public PolicyController {
 public:
  FunctionController(Function function, const ActionChoice& choice, Renderer* renderer)
      : function_(std::move(function)), choice_(choice), renderer_(renderer) {}

  std::string_view name() const override { return function_.name(); }

  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name(), input, {}, mask, commands_out);
    const auto slots = static_cast<int64_t>(commands_out.size());
    std::vector<uint8_t> is_drawn;
    for (int64_t slot = 0; slot < slots; ++slot) {
      const bool is_selected = mask.empty() || mask[slot] != 0;
      is_drawn.push_back(is_selected && takes_actions(input.state.status[slot]) ? 1 : 0);
    }
    num_driven_ = std::count(is_drawn.begin(), is_drawn.end(), 1);
    std::vector<float> log_probs(commands_out.size() * kNumActions), values(commands_out.size());
    function_.respond(
        {.observations = input.observations, .scene = &input.scene, .views = input.views, .is_drawn = is_drawn},
        renderer_, log_probs, values);
    host::log_softmax(log_probs.data(), slots, kNumActions, log_probs.data());
    const ActionRule action_of(input, choice_);
    for (int64_t slot = 0; slot < slots; ++slot) {
      if (mask.empty() || mask[slot] != 0) {
        commands_out[slot] = {.action = action_of(slot, &log_probs[static_cast<size_t>(slot * kNumActions)])};
      }
    }
  }

  int64_t num_driven() const override { return num_driven_; }

 private:
  Function function_;
  ActionChoice choice_;
  Renderer* renderer_;
  int64_t num_driven_ = 0;
};

struct FunctionSession final : SessionParts {
  FunctionSession(Function its_function, const Config& its_config, const Rig& its_rig, double its_camera_severity)
      : SessionParts(its_config, Device{}, its_rig, its_camera_severity), function(std::move(its_function)) {
    observes_vectors = true;
  }

  std::string policy_hash() const override { return function.name(); }

  std::unique_ptr<SessionParts> make_untrained(uint64_t /*seed*/) const override {
    fail_usage("{}: expected a saved policy, whose weights can be randomized, got a function", function.name());
  }

  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out,
                Span<float> values_out) const override {
    if (config.reads_images()) check_images(input, values_out.size(), renderer);
    function.respond(input, config.reads_images() ? renderer : nullptr, logits_out, values_out);
  }

  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool /*hides_auxiliary*/) const override {
    return std::make_unique<FunctionController>(function, ActionChoice{argmax, seed}, renderer);
  }

  const Function function;
};

}  // namespace

std::string name_of_function(const py::function& function) {
  const py::object named = py::hasattr(function, "__name__") ? py::object(function) : py::type::of(function);
  return "function " + py::cast<std::string>(named.attr("__name__"));
}

std::function<std::unique_ptr<Controller>(const DriverOptions&, const Simulator&, Renderer*)> function_controllers(
    const py::function& function) {
  return [held = Function(function)](const DriverOptions& options, const Simulator& simulator, Renderer* renderer) {
    PICTURA_CHECK(simulator.device().is_host(), "{}: expected a simulator on cpu, got one on {}", held.name(),
                  name_of(simulator.device()));
    return std::make_unique<FunctionController>(held, ActionChoice{options.argmax, options.seed}, renderer);
  };
}

std::function<std::unique_ptr<PolicySession>(const DriverOptions&)> function_sessions(const py::function& function) {
  return [held = Function(function)](const DriverOptions& options) {
    if (options.device != "auto" && options.device != "cpu") {
      fail_usage("device: expected auto or cpu for {}, got {}", held.name(), options.device);
    }
    if (options.decision_steps > 0) {
      fail_usage("decision_steps: expected trained policies, got {}", held.name());
    }
    const std::optional<Rig> rig = named_rig(options);
    Config config;
    config.policy.modality = rig ? Modality::perspective : Modality::vector;
    config = with_session_options(config, options);
    return std::make_unique<PolicySession>(
        std::make_unique<FunctionSession>(held, config, rig ? *rig : rig_of(config, 0), options.camera_severity));
  };
}

}  // namespace pictura::python
