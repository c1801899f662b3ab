// Classes behind pictura.Simulator and pictura.Controller, which exchange arrays without copies.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pictura/backends/make_simulator.h"
#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/bindings/owned_memory.h"
#include "pictura/drawing/world.h"
#include "pictura/simulator/agent_state_arrays.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/observation_arrays.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#endif

namespace pictura::python {

/// The next step overwrites these arrays.
struct StepArraysOfPython {
  py::object reward, terminated, truncated, valid, refusal, reward_terms, distance_m;
};

struct Snapshot {
  std::shared_ptr<Simulator> of;
  std::unique_ptr<StateSnapshot> state;
};

class PyController;

/// Simulator with its maps and arrays.
class PySimulator {
 public:
  PySimulator(const std::string& executor, const SimulatorConfig& config, const std::vector<std::shared_ptr<Map>>& maps,
              std::vector<WorldSpec> worlds, Stream stream)
      : executor_(executor), config_(config), stream_(stream) {
    make(config, compiled(maps), std::move(worlds));
    maps_ = maps;
    calls_ = std::make_unique<Calls>(config.num_threads, simulator_->device());
  }

  Simulator& simulator() { return *simulator_; }
  const std::shared_ptr<Simulator>& shared() const { return simulator_; }
  Calls& calls() { return *calls_; }
  Stream stream() const { return stream_; }
  void set_stream(Stream stream) {
    stream_ = stream;
    forget_arrays();
  }
  const std::string& choice() const { return choice_; }
  const std::vector<std::shared_ptr<Map>>& maps() const { return maps_; }

  /// Within the capacity, arrays keep their addresses. Otherwise a new simulator replaces the old one, whose memory
  /// lasts as long as Python's arrays.
  void set_worlds(const std::vector<std::shared_ptr<Map>>& maps, std::vector<WorldSpec> worlds, uint64_t seed) {
    CompiledMaps next = compiled(maps);
    const SimulatorCapacity needs = capacity_checked(next, worlds);
    if (capacity_.holds(needs)) {
      calls_->run("set_worlds", [&] { simulator_->set_worlds(std::move(next), {}, std::move(worlds), seed, stream_); });
    } else {
      const std::unique_ptr<Calls>& calls = calls_;
      calls->run("set_worlds", [] {});
      SimulatorConfig config = config_;
      config.seed = seed;
      make(config, std::move(next), std::move(worlds));
      config_ = config;
    }
    maps_ = maps;
    watchers_.clear();  // they observe only the previous worlds
    forget_arrays();
  }

  void reset(const py::object& world_mask, const std::optional<uint64_t>& seed) {
    const uint64_t its_seed = seed.value_or(simulator_->config().seed);
    Span<const uint8_t> mask;  // empty: all worlds
    if (!world_mask.is_none()) {
      BorrowedArray borrowed = borrow(world_mask, "reset: world_mask", stream_);
      mask = borrowed.array().checked<const uint8_t>(
          "reset: world_mask", {static_cast<int64_t>(simulator_->worlds().size())}, simulator_->device());
      calls_->run("reset", [&] { simulator_->reset(borrowed.array(), its_seed, stream_); });
      keep(std::move(borrowed));
    } else if (seed) {
      const Array all = all_worlds();
      calls_->run("reset", [&] { simulator_->reset(all, its_seed, stream_); });
    } else {
      calls_->run("reset", [&] { simulator_->reset(stream_); });
    }
    for (const auto& watcher : watchers()) calls_->run("reset", [&] { watcher->after_reset(mask); });
  }

  py::object step(const py::object& actions) {
    BorrowedArray borrowed = borrow(actions, "step: actions", stream_);
    const StepResult result = is_watched()
                                  ? watched_step(borrowed.array())
                                  : calls_->run("step", [&] { return simulator_->step(borrowed.array(), stream_); });
    keep(std::move(borrowed));
    return arrays_of(result);
  }
  py::object step_commands(const py::object& commands) {
    BorrowedArray borrowed = borrow_structs(commands, "step_commands: commands", sizeof(Command), stream_);
    const auto bytes = borrowed.array().checked<const uint8_t>(
        "step_commands: commands", {simulator_->num_slots(), static_cast<int64_t>(sizeof(Command))},
        simulator_->device());
    PICTURA_CHECK(reinterpret_cast<uintptr_t>(bytes.data()) % alignof(Command) == 0,
                  "step_commands: commands: expected aligned memory");
    const Span<const Command> span(reinterpret_cast<const Command*>(bytes.data()),
                                   static_cast<size_t>(simulator_->num_slots()));
    const StepResult result = is_watched()
                                  ? watched_step({span.begin(), span.end()})
                                  : calls_->run("step_commands", [&] { return simulator_->step(span, stream_); });
    keep(std::move(borrowed));
    return arrays_of(result);
  }

  SimulatorInside inside() {
    return {simulator_, [this](std::string_view what, const std::function<void()>& work) { calls_->run(what, work); },
            [this](const std::shared_ptr<StepObserver>& watcher) { watchers_.push_back(watcher); }};
  }

  void set_state(const py::object& slots, const py::dict& fields) {
    BorrowedArray borrowed_slots = borrow(slots, "set_state: slots", stream_);
    std::vector<std::string> names;
    std::vector<BorrowedArray> borrowed;
    for (const auto& [name, values] : fields) {
      names.push_back(py::cast<std::string>(name));
      borrowed.push_back(borrow(values, "set_state: " + names.back(), stream_));
    }
    std::vector<NamedArray> named;
    for (size_t i = 0; i < names.size(); ++i) named.push_back({names[i], borrowed[i].array()});
    calls_->run("set_state", [&] { simulator_->set_state(borrowed_slots.array(), named, stream_); });
    borrowed.push_back(std::move(borrowed_slots));
    keep(std::move(borrowed));
  }

  py::dict observations() {
    if (!observations_) {
      observations_ = lent_observations(simulator_->observations(), simulator_->num_slots(), simulator_);
    }
    return *observations_;
  }

  py::object observe(const py::object& queries, const py::object& hidden, const py::object& inserted,
                     const py::object& out) {
    std::vector<BorrowedArray> borrowed;
    const Span<const ObservationQuery> asked = structs_of<ObservationQuery>(queries, "observe: queries", &borrowed);
    const Span<const InsertedBox> boxes = structs_of<InsertedBox>(inserted, "observe: inserted", &borrowed);
    Span<const int32_t> left_out;
    if (!hidden.is_none()) {
      borrowed.push_back(borrow(hidden, "observe: hidden", stream_));
      const Array& array = borrowed.back().array();
      left_out = array.checked<const int32_t>("observe: hidden", {array.shape.count()}, simulator_->device());
    }
    const auto count = static_cast<int64_t>(asked.size());
    ObservationView view;
    py::object answers = out;
    if (out.is_none()) {
      const auto memory = std::make_shared<AnswerMemory>(count, simulator_->config(), simulator_->device());
      view = memory->view();
      answers = lent_observations(view, static_cast<int>(count), memory);
    } else {
      view = view_of(py::cast<py::dict>(out), count, &borrowed);
    }
    calls_->run("observe", [&] { simulator_->observe(asked, left_out, boxes, view, stream_); });
    keep(std::move(borrowed));
    return answers;
  }
  py::dict state() {
    if (!state_) {
      py::dict arrays;
      for (const NamedArray& named :
           agent_state_arrays(simulator_->state(), simulator_->num_slots(), simulator_->device())) {
        Array array = named.array;
        array.is_read_only = true;
        arrays[py::str(std::string(named.name))] = py::cast(lend(array, std::string(named.name)));
      }
      state_ = arrays;
    }
    return *state_;
  }

  LentArray lend(const Array& array, std::string what, bool is_bool = false) const {
    return {array, simulator_, stream_, is_bool, std::move(what)};
  }
  py::dict lent_observations(const ObservationView& view, int count, const std::shared_ptr<const void>& owner) const {
    py::dict arrays;
    for (const NamedArray& named : observation_arrays(view, count, simulator_->device())) {
      const std::string name(named.name);
      Array array = named.array;
      array = Array(array.data, array.type, shape_of(array.shape[0], array.shape[1], array.shape[2]), array.device);
      arrays[py::str(name)] = py::cast(LentArray{array, owner, stream_, false, name});
    }
    return arrays;
  }
  template <typename T>
  LentArray lend_span(Span<T> span, std::string what, bool is_bool = false) const {
    return lend(Array(span.data(), {static_cast<int64_t>(span.size())}, simulator_->device()), std::move(what),
                is_bool);
  }
  template <typename T>
  LentArray lend_structs(Span<const T> span, std::string what) const {
    return lend(Array(reinterpret_cast<const uint8_t*>(span.data()),
                      {static_cast<int64_t>(span.size()), static_cast<int64_t>(sizeof(T))}, simulator_->device()),
                std::move(what));
  }

  std::shared_ptr<Scene> scene() {
    auto scene = std::make_shared<Scene>();
    scene->owner = simulator_;
    scene->stream = stream_;
    scene->batch = [raw = simulator_.get()] { return raw->scene(); };
    return scene;
  }

  py::array_t<uint8_t> draw(int world, int agent, int width_px, int height_px, float width_m) {
    PICTURA_CHECK(simulator_->device().is_host(), "draw: expected a simulator on cpu, got one on {}",
                  name_of(simulator_->device()));
    PICTURA_CHECK(world >= 0 && world < static_cast<int>(simulator_->worlds().size()),
                  "draw: expected a world in [0, {}), got {}", simulator_->worlds().size(), world);
    const WorldSpec& spec = simulator_->worlds()[world];
    PICTURA_CHECK(agent >= -1 && agent < spec.num_agents, "draw: expected an agent in [0, {}), or -1, got {}",
                  spec.num_agents, agent);
    const CompiledMap& map = *simulator_->maps()[spec.map];
    const RgbImage image = calls_->run("draw", [&] {
      if (!painter_ || painted_map_ != map.road || painter_->width_px() != width_px ||
          painter_->height_px() != height_px) {
        painter_ =
            std::make_unique<WorldPainter>(*map.road, width_px, height_px, map.geometry.walls, map.scenario.get());
        painted_map_ = map.road;
      }
      return draw_world(*painter_, *simulator_, world, agent, width_m);
    });
    py::array_t<uint8_t> pixels({image.height_px, image.width_px, 3});
    std::copy(image.rgb.begin(), image.rgb.end(), pixels.mutable_data());
    return pixels;
  }

  void run(PyController& controller, int64_t steps);

  /// Takes steps in calls of about 50 ms. Between calls, ^C is handled and other threads may call the simulator.
  template <typename Work>
  void run_steps(int64_t steps, const Work& step) {
    using Clock = std::chrono::steady_clock;
    int64_t done = 0;
    while (done < steps) {
      calls_->run("run", [&] {
        const auto begin = Clock::now();
        do step();
        while (++done < steps && Clock::now() - begin < std::chrono::milliseconds(50));
      });
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }

 private:
  /// Arrays with one row get no dimension for rows.
  static Dims shape_of(int64_t count, int64_t rows, int64_t features) {
    return rows == 1 ? Dims{count, features} : Dims{count, rows, features};
  }

  class AnswerMemory {
   public:
    AnswerMemory(int64_t count, const SimulatorConfig& config, Device device) {
      size_t num_bytes = 0;
      const auto place = [&](int64_t values, size_t bytes_per_value) {
        const size_t begin = num_bytes;
        num_bytes += (static_cast<size_t>(values) * bytes_per_value + kAlignment - 1) / kAlignment * kAlignment;
        return begin;
      };
      std::vector<size_t> begins;
      for (const ObservationArray& array : kObservationArrays) {
        const int64_t values = config.observes(array.part) ? count * array.rows * array.features : 0;
        begins.push_back(place(values, bytes_of(array.type)));
      }
      uint8_t* const first = memory_.allocate(num_bytes, device, "observe");
      size_t i = 0;
#define X(name, type, rows, features, part, comment)                                                             \
  if (config.observes(part)) {                                                                                   \
    view_.name = {reinterpret_cast<type*>(first + begins[i]), static_cast<size_t>(count * (rows) * (features))}; \
  }                                                                                                              \
  ++i;
      PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    }
    const ObservationView& view() const { return view_; }

   private:
    static constexpr size_t kAlignment = 64;
    OwnedMemory memory_;
    ObservationView view_;
  };

  template <typename T>
  Span<const T> structs_of(const py::object& object, const std::string& what, std::vector<BorrowedArray>* borrowed) {
    if (object.is_none()) return {};
    borrowed->push_back(borrow_structs(object, what, sizeof(T), stream_));
    const Array& array = borrowed->back().array();
    const int64_t count = array.shape.rank() == 2 ? array.shape[0] : 0;
    const auto bytes =
        array.checked<const uint8_t>(what, {count, static_cast<int64_t>(sizeof(T))}, simulator_->device());
    PICTURA_CHECK(reinterpret_cast<uintptr_t>(bytes.data()) % alignof(T) == 0, "{}: expected aligned memory", what);
    return {reinterpret_cast<const T*>(bytes.data()), static_cast<size_t>(count)};
  }

  /// The dict must contain exactly the arrays that this simulator observes.
  ObservationView view_of(const py::dict& arrays, int64_t count, std::vector<BorrowedArray>* borrowed) {
    ObservationView view;
    size_t num_known = 0;
    const auto take = [&](const char* name, int64_t rows, int64_t features, auto* out) {
      using T = std::remove_reference_t<decltype((*out)[0])>;
      const std::string what = fmt::format("observe: out: {}", name);
      PICTURA_CHECK(arrays.contains(name), "{}: expected an array, got none", what);
      borrowed->push_back(borrow(arrays[name], what, stream_));
      *out = borrowed->back().array().template checked<T>(what, shape_of(count, rows, features), simulator_->device());
      ++num_known;
    };
#define X(name, type, rows, features, part, comment) \
  if (simulator_->config().observes(part)) take(#name, rows, features, &view.name);
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    PICTURA_CHECK(arrays.size() == num_known, "observe: out: expected {} arrays, those of observations, got {}",
                  num_known, arrays.size());
    return view;
  }

  // Returns the observers that still exist.
  std::vector<std::shared_ptr<StepObserver>> watchers() {
    std::erase_if(watchers_, [](const auto& watcher) { return watcher.expired(); });
    std::vector<std::shared_ptr<StepObserver>> watching;
    for (const auto& watcher : watchers_) {
      if (auto one = watcher.lock()) watching.push_back(std::move(one));
    }
    return watching;
  }
  bool is_watched() { return !watchers_.empty() && !watchers().empty(); }
  StepResult watched_step(const Array& actions) {
    const auto indices =
        actions.checked<const int32_t>("step: actions", {simulator_->num_slots()}, simulator_->device());
    std::vector<Command> commands;
    for (const int32_t action : indices) commands.push_back({.action = action});
    return watched_step(std::move(commands));
  }
  /// Waits until observers are ready (^C ends this wait), then calls step_observed().
  StepResult watched_step(std::vector<Command> commands) {
    const std::vector<std::shared_ptr<StepObserver>> watching = watchers();
    for (const auto& watcher : watching) {
      while (!calls_->run("step", [&] { return watcher->is_due(); })) {
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      }
    }
    return calls_->run("step", [&] { return step_observed(*simulator_, Span<Command>(commands), watching, stream_); });
  }

  CompiledMaps compiled(const std::vector<std::shared_ptr<Map>>& maps) {
    if (maps.empty()) fail_usage("simulator: expected at least one map");
    CompiledMaps made;
    for (const auto& map : maps) {
      PICTURA_CHECK(map, "simulator: maps: expected maps, got None");
      made.push_back(map->compiled(map_options(config_)));
    }
    return made;
  }
  static SimulatorCapacity capacity_checked(const CompiledMaps& maps, const std::vector<WorldSpec>& worlds) {
    for (const WorldSpec& world : worlds) {
      if (world.map < 0 || world.map >= static_cast<int>(maps.size())) {
        fail_usage("simulator: world {}: expected a map in [0, {}), got {}", world.global_world, maps.size(),
                   world.map);
      }
    }
    return capacity_of(maps, worlds);
  }
  void make(const SimulatorConfig& config, CompiledMaps maps, std::vector<WorldSpec> worlds) {
    const SimulatorCapacity needs = capacity_checked(maps, worlds);
    check_process("Simulator", config.num_threads, config.device);
    {
      const GilRelease no_gil;
      simulator_ = make_simulator(executor_, config, std::move(maps), std::move(worlds), &choice_);
    }
    check_device("Simulator", config.device, simulator_->device(), choice_);
    capacity_ = needs;
  }
  void forget_arrays() {
    observations_.reset();
    state_.reset();
    result_ = {};
    of_result_ = nullptr;
  }
  /// Keeps the arrays of the last call alive, because a device may still read them. The release of previous arrays
  /// comes last, because it may call Python code that calls this object.
  void keep(std::vector<BorrowedArray> arrays) { kept_.swap(arrays); }
  void keep(BorrowedArray array) {
    std::vector<BorrowedArray> arrays;
    arrays.push_back(std::move(array));
    keep(std::move(arrays));
  }
  Array all_worlds() {
    const auto count = static_cast<int64_t>(simulator_->worlds().size());
    if (simulator_->device().is_host()) {
      all_on_host_.assign(count, 1);
      return {all_on_host_.data(), {count}, Device{}};
    }
#ifdef PICTURA_HAS_CUDA
    const DeviceGuard guard(simulator_->device());
    if (all_on_device_.size() != static_cast<size_t>(count)) {
      all_on_device_ = DeviceBuffer<uint8_t>(static_cast<size_t>(count));
      all_on_device_.fill(1);
      PICTURA_CUDA(cudaDeviceSynchronize());
    }
    return {all_on_device_.data(), {count}, simulator_->device()};
#else
    fail("reset: this build has no CUDA");
#endif
  }

  py::object arrays_of(const StepResult& result) {
    if (of_result_ != result.reward.data() || !result_) {
      StepArraysOfPython arrays;
      arrays.reward = py::cast(lend_span(result.reward, "reward"));
      arrays.terminated = py::cast(lend_span(result.terminated, "terminated", true));
      arrays.truncated = py::cast(lend_span(result.truncated, "truncated", true));
      arrays.valid = py::cast(lend_span(result.valid, "valid", true));
      arrays.refusal = py::cast(lend_span(result.refusal, "refusal"));
      constexpr int64_t kFloats = sizeof(StepSums) / sizeof(float), kTerms = sizeof(RewardTerms) / sizeof(float);
      const auto num_slots = static_cast<int64_t>(result.sums.size());
      const auto* const first = reinterpret_cast<const float*>(result.sums.data());
      Array distance_m(first, {num_slots}, simulator_->device());
      distance_m.strides[0] = kFloats;
      Array terms(first + offsetof(StepSums, reward_terms) / sizeof(float), {num_slots, kTerms}, simulator_->device());
      terms.strides[0] = kFloats;
      arrays.distance_m = py::cast(lend(distance_m, "distance_m"));
      arrays.reward_terms = py::cast(lend(terms, "reward_terms"));
      result_ = py::cast(std::move(arrays));
      of_result_ = result.reward.data();
    }
    return result_;
  }

  std::string executor_, choice_;
  SimulatorConfig config_;
  Stream stream_;
  std::vector<std::shared_ptr<Map>> maps_;
  std::shared_ptr<Simulator> simulator_;
  SimulatorCapacity capacity_;
  std::unique_ptr<Calls> calls_;
  std::optional<py::dict> observations_, state_;
  py::object result_;
  const float* of_result_ = nullptr;
  std::vector<BorrowedArray> kept_;  // arrays of the last call
  std::vector<std::weak_ptr<StepObserver>> watchers_;
  std::vector<uint8_t> all_on_host_;
#ifdef PICTURA_HAS_CUDA
  DeviceBuffer<uint8_t> all_on_device_;
#endif
  std::shared_ptr<const RoadMap> painted_map_;
  std::unique_ptr<WorldPainter> painter_;
};

/// Controller with its commands on the simulator's device.
class PyController {
 public:
  explicit PyController(ControllerInside inside)
      : inside_(std::move(inside)),
        maps_(of().maps()),
        worlds_(of().worlds().begin(), of().worlds().end()),
        commands_(std::make_shared<Commands>()) {
    const auto count = static_cast<size_t>(of().num_slots());
#ifdef PICTURA_HAS_CUDA
    if (!of().device().is_host()) {
      const DeviceGuard guard(of().device());
      commands_->on_device = DeviceBuffer<Command>(count);
      commands_->span = {commands_->on_device.data(), count};
      return;
    }
#endif
    commands_->on_host.resize(count);
    commands_->span = commands_->on_host;
  }

  std::string name() const { return std::string(inside_.controller->name()); }
  const ControllerInside& inside() const { return inside_; }
  /// Must be called without the GIL.
  void act(const PySimulator& simulator) {
    const bool has_same_worlds = std::ranges::equal(of().maps(), maps_) && std::ranges::equal(of().worlds(), worlds_);
    PICTURA_CHECK(simulator.shared() == inside_.of && has_same_worlds,
                  "Controller: expected its own simulator and worlds");
    inside_.controller->act(of().arrays(), {}, commands_->span, simulator.stream());
  }
  Span<const Command> commands() const { return commands_->span; }
  /// Returns a NumPy array of COMMAND_DTYPE on the host, u8 [slots, sizeof(Command)] on a device.
  py::object lent_commands(Stream stream) const {
    const auto count = static_cast<int64_t>(commands_->span.size());
    auto* const bytes = reinterpret_cast<uint8_t*>(commands_->span.data());
    const LentArray lent{Array(bytes, {count, static_cast<int64_t>(sizeof(Command))}, of().device()), commands_, stream,
                         false, "commands"};
    const py::object array = py::cast(lent);
    if (!of().device().is_host()) return array;
    const py::object type = py::module_::import("pictura._pictura").attr("COMMAND_DTYPE");
    return array.attr("numpy")().attr("view")(type).attr("reshape")(count);
  }

 private:
  struct Commands {
    std::vector<Command> on_host;
#ifdef PICTURA_HAS_CUDA
    DeviceBuffer<Command> on_device;
#endif
    Span<Command> span;
  };
  Simulator& of() const { return *inside_.of; }

  ControllerInside inside_;
  const CompiledMaps maps_;
  const std::vector<WorldSpec> worlds_;
  std::shared_ptr<Commands> commands_;
};

void define_controller(py::class_<PyController>* controller);

void bind_names(py::module_& module);

}  // namespace pictura::python
