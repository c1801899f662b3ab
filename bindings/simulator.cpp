// Simulators and controllers in Python.
#include <chrono>
#include <cmath>
#include <cstring>
#include <optional>

#include <pybind11/stl.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/bindings/options.h"
#include "pictura/bindings/owned_memory.h"
#include "pictura/drawing/world.h"
#include "pictura/simulator/agent_state_arrays.h"
#include "pictura/simulator/controllers/shared_control.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/simulator_options.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#endif

namespace pictura::python {

namespace {

using WorldTuple = std::tuple<int, int, uint32_t>;  // map, agents, global world

std::vector<WorldSpec> worlds_of(const py::sequence& worlds) {
  std::vector<WorldSpec> specs;
  for (const py::handle world : worlds) {
    const std::string what = fmt::format("worlds: world {}", specs.size());
    const auto next = static_cast<uint32_t>(specs.size());
    constexpr const char* kExpected = "integers (map, agents) or (map, agents, global world)";
    if (py::isinstance<py::sequence>(world) && py::len(world) == 2) {
      const auto [map, agents] = cast_checked<std::pair<int, int>>(world, what, kExpected);
      specs.push_back({map, agents, next});
    } else {
      const auto [map, agents, global_world] = cast_checked<WorldTuple>(world, what, kExpected);
      specs.push_back({map, agents, global_world});
    }
  }
  return specs;
}

template <typename Terms>
py::dict dict_of_terms(const Terms& terms) {
  py::dict d;
#define X(name) d[#name] = terms.name;
  PICTURA_REWARD_TERMS(X)
#undef X
  return d;
}

py::dict dict_of(const SimulatorTotals& t) {
  py::dict d;
  d["agent_steps"] = t.agent_steps;
  d["slot_steps"] = t.slot_steps;
  d["episodes"] = t.episodes;
  d["goals_reached"] = t.goals_reached;
  d["waypoints_reached"] = t.waypoints_reached;
  d["collisions"] = t.collisions;
  d["at_fault_collisions"] = t.at_fault_collisions;
  d["off_road"] = t.off_road;
  d["red_light"] = t.red_light;
  d["wall_contacts"] = t.wall_contacts;
  d["distance_m"] = t.distance_m;
  d["reward"] = t.reward;
  d["reward_terms"] = dict_of_terms(t.reward_terms);
  d["finished_agent_episodes"] = t.finished_agent_episodes;
  d["finished_return"] = t.finished_return;
  d["finished_passed_waypoint"] = t.finished_passed_waypoint;
  d["finished_moved"] = t.finished_moved;
  d["finished_first_motion_s"] = t.finished_first_motion_s;
  return d;
}

/// What a step returned, as arrays that the next step writes again.
struct StepArraysOfPython {
  py::object reward, terminated, truncated, valid, refusal, reward_terms, distance_m;
};

/// A state that a simulator keeps.
struct Snapshot {
  std::shared_ptr<Simulator> of;
  std::unique_ptr<StateSnapshot> state;
};

class PyController;

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

  /// Within the memory that there is nothing moves; else arrays of before keep that of the simulator of before.
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
    watchers_.clear();  // they saw the worlds before
    forget_arrays();
  }

  void reset(const py::object& world_mask, const std::optional<uint64_t>& seed) {
    const uint64_t its_seed = seed.value_or(simulator_->config().seed);
    Span<const uint8_t> mask;  // empty: of all
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

  /// Steps by the commands that a controller writes.
  void run(PyController& controller, int64_t steps);

  /// Until a moment ago another thread could be in a call: as in any call.
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
  /// What is no set has one row.
  static Dims shape_of(int64_t count, int64_t rows, int64_t features) {
    return rows == 1 ? Dims{count, features} : Dims{count, rows, features};
  }

  /// Memory for what so many queries are answered, on a device.
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

  /// Arrays of the caller by name, all that this simulator observes.
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

  // Those that are gone see nothing more.
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
  /// ^C ends the wait.
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
      const WithoutGil no_gil;
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
  /// On a device the work that reads them may still be to come. What was kept goes last: its end may call Python, which
  /// may call this object.
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
  std::vector<BorrowedArray> kept_;  // what the last call was given
  std::vector<std::weak_ptr<StepObserver>> watchers_;
  std::vector<uint8_t> all_on_host_;
#ifdef PICTURA_HAS_CUDA
  DeviceBuffer<uint8_t> all_on_device_;
#endif
  std::shared_ptr<const RoadMap> painted_map_;
  std::unique_ptr<WorldPainter> painter_;
};

/// A controller, its simulator, and the commands that it writes, in the simulator's memory.
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
  /// Without the GIL.
  void act(const PySimulator& simulator) {
    const bool has_same_worlds = std::ranges::equal(of().maps(), maps_) && std::ranges::equal(of().worlds(), worlds_);
    PICTURA_CHECK(simulator.shared() == inside_.of && has_same_worlds,
                  "Controller: expected the simulator, and the worlds, that it was made for");
    inside_.controller->act(of().arrays(), {}, commands_->span, simulator.stream());
  }
  Span<const Command> commands() const { return commands_->span; }
  /// A NumPy array of COMMAND_DTYPE, or u8 [slots, bytes of a command] on a device.
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

void PySimulator::run(PyController& controller, int64_t steps) {
  if (is_watched()) {
    for (int64_t step = 0; step < steps; ++step) {
      calls_->run("run", [&] { controller.act(*this); });
      watched_step({controller.commands().begin(), controller.commands().end()});
    }
    return;
  }
  run_steps(steps, [&] {
    controller.act(*this);
    simulator_->step(controller.commands(), stream_);
  });
}

/// A controller that others hold as well.
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

/// What several controllers of one simulator become; a mask that is None is everybody.
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

py::dict report_of(const SpawnReport& report) {
  py::dict d;
  d["asked"] = report.asked;
  d["spawned"] = report.spawned;
  d["refused"] = report.refused;
  d["refused_no_place"] = report.refused_no_place;
  d["refused_taken"] = report.refused_taken;
  d["entered"] = report.entered;
  d["left"] = report.left;
  d["parked_asked"] = report.parked_asked;
  d["parked_placed"] = report.parked_placed;
  return d;
}

void bind_names(py::module_& module) {
  py::list fields;
  for (size_t i = 0; i < std::size(kAgentFields); ++i) {
    const AgentFieldInfo& info = kAgentFields[i];
    fields.append(py::make_tuple(std::string(info.name), std::string(name_of(info.type)), info.per_agent,
                                 is_derived(static_cast<AgentField>(i)), std::string(info.comment)));
  }
  module.attr("AGENT_FIELDS") = py::tuple(fields);
  py::list observations;
  for (const ObservationArray& array : kObservationArrays) {
    observations.append(
        py::make_tuple(std::string(array.name), std::string(name_of(array.type)), array.rows, array.features));
  }
  module.attr("OBSERVATION_ARRAYS") = py::tuple(observations);
  module.attr("CONDITIONING_NAMES") =
      py::tuple(py::cast(std::vector<std::string>(std::begin(kConditioningNames), std::end(kConditioningNames))));
  std::vector<std::string> terms;
#define X(name) terms.emplace_back(#name);
  PICTURA_REWARD_TERMS(X)
#undef X
  module.attr("REWARD_TERMS") = py::tuple(py::cast(terms));
  module.attr("NUM_ACTIONS") = kNumActions;
  module.attr("IDLE_ACTION") = kIdleAction;
  py::list command;
  for (const char* name : {"kind", "action"}) command.append(py::make_tuple(name, "<i4"));
  for (const char* name : {"x_m", "y_m", "z_m", "heading_rad", "speed_mps"})
    command.append(py::make_tuple(name, "<f4"));
  // Fields as NumPy takes them.
  const auto dtype_of = [](const py::list& members, size_t size, const char* what) {
    const py::object type = py::module_::import("numpy").attr("dtype")(members);
    PICTURA_CHECK(py::cast<size_t>(type.attr("itemsize")) == size, "{}'s layout", what);
    return type;
  };
  py::list query;
  for (const char* name : {"slot", "hidden_begin", "hidden_end", "inserted_begin", "inserted_end", "leaves_gaps"}) {
    query.append(py::make_tuple(name, "<i4"));
  }
  module.attr("COMMAND_DTYPE") = dtype_of(command, sizeof(Command), "a command");
  module.attr("QUERY_DTYPE") = dtype_of(query, sizeof(ObservationQuery), "a query");
  py::list inserted;
  inserted.append(py::make_tuple("box", module.attr("BOX_DTYPE")));
  inserted.append(py::make_tuple("speed_mps", "<f4"));
  module.attr("INSERTED_DTYPE") = dtype_of(inserted, sizeof(InsertedBox), "an inserted box");
  py::dict events;
  events["collision"] = static_cast<int>(kEventCollision);
  events["at_fault"] = static_cast<int>(kEventAtFault);
  events["off_road"] = static_cast<int>(kEventOffRoad);
  events["red_light"] = static_cast<int>(kEventRedLight);
  events["wall"] = static_cast<int>(kEventWall);
  events["goal"] = static_cast<int>(kEventGoal);
  events["waypoint"] = static_cast<int>(kEventWaypoint);
  events["metric_goal"] = static_cast<int>(kEventMetricGoal);
  module.attr("EVENTS") = events;
}

void bind_step_result(py::module_& module) {
  py::class_<StepArraysOfPython>(module, "StepResult", R"(
What a step returns, one element a slot, in the simulator's memory: every step writes the same arrays again.)")
      .def_readonly("reward", &StepArraysOfPython::reward, "float32 [slots].")
      .def_readonly("terminated", &StepArraysOfPython::terminated,
                    "bool [slots]: an infraction ended the agent's episode in this step.")
      .def_readonly("truncated", &StepArraysOfPython::truncated,
                    "bool [slots]: the episode ended for another reason: bootstrap.")
      .def_readonly("valid", &StepArraysOfPython::valid,
                    "bool [slots]: the agent was active when the step began: learn from it.")
      .def_readonly("refusal", &StepArraysOfPython::refusal,
                    "uint8 [slots]: why the agent is absent from this episode: 1 no place, 2 all taken; 0: it is not.")
      .def_readonly("reward_terms", &StepArraysOfPython::reward_terms,
                    "float32 [slots, 11]: of which the reward is made, in the order of pictura.REWARD_TERMS.")
      .def_readonly("distance_m", &StepArraysOfPython::distance_m, "float32 [slots]: driven in this step.");
}

struct SimulatorArguments {
  std::vector<std::shared_ptr<Map>> maps;
  py::sequence worlds = py::list();
  std::string executor = "auto";
  SimulatorConfig config;
  py::object stream = py::none();
};

template <typename Visitor>
void visit_options(SimulatorArguments& arguments, Visitor&& v) {
  v.value({"maps"}, arguments.maps);
  v.value({"worlds"}, arguments.worlds);
  v.value({"executor"}, arguments.executor);
  visit_options(arguments.config, v);
  v.value({"stream"}, arguments.stream);
}

// How one is made, and what it is made of.
void define_construction(py::class_<PySimulator>* simulator) {
  def_init_with_options<SimulatorArguments>(
      simulator, {"Simulator", {"maps", "worlds"}},
      [](const SimulatorArguments& arguments) {
        return std::make_unique<PySimulator>(arguments.executor, arguments.config, arguments.maps,
                                             worlds_of(arguments.worlds), stream_of(arguments.stream));
      },
      R"(maps: of pictura.Map. worlds: of (index of the map, agents), or (map, agents, global world), which keys the
world's random numbers. executor: 'cpu', 'cuda' or 'auto'. device: where observations and scenes are wanted. num_threads: of
the host, 0 for all. reset_inactive_fraction: a world resets when this part of its agents is inactive; more than 1: never.
stagger_episodes: the first episode of each world ends after a drawn number of steps. light_cycles: 'phases', those of a junction
take turns, or 'independent', each light cycles alone. reset_at_standstill: accelerations end where the speed changes its sign.
forbid_reversing: agents at rest do not begin to drive backwards.
light_heads: 'as_mapped', or 'visible': heads beside or before their stop line stand 10 m beyond it, 3.5 m high.
conditioning: a number or (low, high) by name, see CONDITIONING_NAMES; the paper's ranges otherwise. stream: a cudaStream_t
as int; None: the legacy default stream. The other defaults are the paper's training world.
Raises pictura.UsageError naming what cannot be simulated, pictura.Error where there is no device.)");
  (*simulator)
      .def("_inside",
           [](PySimulator& self) {
             py::object inside = py::cast(self.inside());
             // Not by py::keep_alive<0, 1>: pybind11 3.1 crashes in it where the arguments are of other types.
             py::detail::keep_alive_impl(inside, py::cast(&self, py::return_value_policy::reference));
             return inside;
           })
      .def_property_readonly("name", [](PySimulator& self) { return std::string(self.simulator().name()); })
      .def_property_readonly("choice", &PySimulator::choice, py::doc("What was chosen for 'auto', and why."))
      .def_property_readonly("device", [](PySimulator& self) { return name_of(self.simulator().device()); })
      .def_property_readonly("maps", &PySimulator::maps)
      .def_property_readonly(
          "worlds",
          [](PySimulator& self) {
            std::vector<WorldTuple> worlds;
            for (const WorldSpec& world : self.simulator().worlds()) {
              worlds.emplace_back(world.map, world.num_agents, world.global_world);
            }
            return worlds;
          },
          py::doc("(map, agents, global world) of each."))
      .def_property_readonly("num_worlds", [](PySimulator& self) { return self.simulator().worlds().size(); })
      .def_property_readonly("num_slots", [](PySimulator& self) { return self.simulator().num_slots(); })
      .def_property_readonly("seed", [](PySimulator& self) { return self.simulator().config().seed; })
      .def_property_readonly("dt_s", [](PySimulator& self) { return self.simulator().config().dt_s; })
      .def_property_readonly("episode_steps", [](PySimulator& self) { return self.simulator().config().episode_steps; })
      .def_property(
          "stream", [](const PySimulator& self) { return reinterpret_cast<intptr_t>(self.stream().handle); },
          [](PySimulator& self, const py::object& stream) { self.set_stream(stream_of(stream)); },
          py::doc("The cudaStream_t that work is put on, as int; 0: the legacy default stream."));
}

// What changes its state, and what its agents would observe.
void define_steps(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def(
          "set_worlds",
          [](PySimulator& self, const std::vector<std::shared_ptr<Map>>& maps, const py::sequence& worlds,
             uint64_t seed) { self.set_worlds(maps, worlds_of(worlds), seed); },
          py::arg("maps"), py::arg("worlds"), py::arg("seed") = 0,
          R"(Other worlds on other maps, at the start of their first episodes: what a new simulator would be. Take the arrays
anew: those of before stay valid memory, which later calls may write. Raises as the constructor does.)")
      .def(
          "reset", &PySimulator::reset, py::arg("world_mask") = py::none(), py::arg("seed") = py::none(),
          R"(Starts new episodes. world_mask: uint8 or bool [worlds] in the simulator's memory, the worlds that start; all without
it. seed: theirs from now on; the simulator's own without it. Raises pictura.Error for another array.)")
      .def(
          "step", &PySimulator::step, py::arg("actions"),
          R"(Advances every world by one step. actions: int32 [slots] in the simulator's memory, each in [0, 12): 3 times the
longitudinal jerk's index (-15, -4, 0, 4 m/s3) plus the lateral one's (-4, 0, 4 m/s3, left positive). Those of inactive agents
are ignored. A world whose last step ended its episode starts the next one instead, and its slots are not valid.
Returns the StepResult. Raises pictura.Error, which leaves the state as it was, for another array and for actions out of
range.)")
      .def(
          "step_commands", &PySimulator::step_commands, py::arg("commands"),
          R"(The same by commands, COMMAND_DTYPE [slots]: kind 0 an action, 1 a kinematic state, 2 absence from the episode,
3 as recorded, in worlds of a pictura.Scenario.)")
      .def(
          "set_state", &PySimulator::set_state, py::arg("slots"), py::arg("fields"),
          R"(Gives fields of chosen agents other values. slots: int32 [n], each once. fields: arrays [n] or [n, per agent] by the
names of AGENT_FIELDS, of their types, all in the simulator's memory. Lane, height, box, view and observation follow. Raises
pictura.Error naming what is wrong; on CUDA values are checked as in step().)")
      .def(
          "observe", &PySimulator::observe, py::arg("queries"), py::arg("hidden") = py::none(),
          py::arg("inserted") = py::none(), py::kw_only(), py::arg("out") = py::none(),
          R"(What chosen slots would observe if boxes of their worlds were not there, and others were. Partners alone differ;
the state stays as it is. pictura.make_queries() makes the arguments:
queries: QUERY_DTYPE [n], or uint8 [n, 24]: a slot, its ranges [begin, end) of the lists `hidden` and `inserted`, and leaves_gaps:
0: who was too far to be among the partners comes in for who is hidden; 1: rows of zeros stay in their place.
hidden: int32 [m], indices into the scene's boxes. inserted: INSERTED_DTYPE [k], or uint8 [k, 40]: a box of BOX_DTYPE and its
speed_mps. out: arrays of the caller by the names of `observations`, with n in place of the slots; new ones without it. All lie
in the simulator's memory. Returns out, arrays by name. Raises pictura.Error naming what is wrong with an array or a query, and
then writes nothing; on CUDA queries are checked as in step().)");
}

// The arrays of its present state.
void define_arrays(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def_property_readonly(
          "observations", &PySimulator::observations,
          py::doc("Arrays [slots, ...] by name, of the state after the last call: ego, partners, lanes, "
                  "boundaries, controls, walls, set_counts, conditioning, waypoints."))
      .def_property_readonly("state", &PySimulator::state,
                             py::doc("Every field of the agents by name, read-only, [slots] or [slots, per agent]."))
      .def_property_readonly("scene", &PySimulator::scene, py::doc("What renderers draw, of all worlds."))
      .def_property_readonly(
          "views", [](PySimulator& self) { return self.lend_structs<View>(self.simulator().views(), "views"); },
          py::doc("One view a slot: uint8 [slots, 40] that render() takes; its fields are VIEW_DTYPE's."))
      .def_property_readonly(
          "episode_step",
          [](PySimulator& self) { return self.lend_span(self.simulator().episode_step(), "episode_step"); },
          py::doc("int32 [worlds]: steps done in the present episode."))
      .def_property_readonly(
          "episode_index",
          [](PySimulator& self) { return self.lend_span(self.simulator().episode_index(), "episode_index"); },
          py::doc("int32 [worlds]: the number of the episode."))
      .def_property_readonly(
          "episode_over",
          [](PySimulator& self) { return self.lend_span(self.simulator().episode_over(), "episode_over", true); },
          py::doc("bool [worlds]: the episode has ended, and the next step begins the next one."))
      .def_property_readonly(
          "world_of_slot",
          [](PySimulator& self) { return self.lend_span(self.simulator().slots().world_of_slot, "world_of_slot"); },
          py::doc("int32 [slots]."))
      .def_property_readonly(
          "agent_of_slot",
          [](PySimulator& self) { return self.lend_span(self.simulator().slots().agent_of_slot, "agent_of_slot"); },
          py::doc("int32 [slots]: the agent's index in its world."));
}

// Counts, and copies of the state.
void define_totals_and_copies(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def(
          "spawn_report",
          [](PySimulator& self) {
            return report_of(
                self.calls().run("spawn_report", [&] { return self.simulator().spawn_report(self.stream()); }));
          },
          "What became of the agents that were asked for: counts by name. Waits for the stream.")
      .def(
          "totals",
          [](PySimulator& self) {
            return dict_of(
                self.calls().run("totals", [&] { return SimulatorTotals(self.simulator().totals(self.stream())); }));
          },
          "Counts and sums since construction by name; reward_terms is a dict. Waits for the stream.")
      .def(
          "state_hash",
          [](PySimulator& self) {
            return self.calls().run("state_hash", [&] { return self.simulator().state_hash(self.stream()); });
          },
          "64 bits over the whole state, equal on every executor. Waits for the stream.")
      .def(
          "save",
          [](PySimulator& self) {
            const auto bytes = self.calls().run("save", [&] { return self.simulator().save(self.stream()); });
            return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
          },
          "The whole state as bytes, for exact resume on any executor. Waits for the stream.")
      .def(
          "restore",
          [](PySimulator& self, const py::bytes& saved) {
            const std::string_view bytes = saved;
            self.calls().run("restore", [&] {
              self.simulator().restore(
                  Span<const uint8_t>(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()), self.stream());
            });
          },
          py::arg("saved"), "Back. Raises pictura.Error naming what differs.")
      .def(
          "restore",
          [](PySimulator& self, const Snapshot& snapshot) {
            PICTURA_CHECK(snapshot.of == self.shared(), "restore: expected a snapshot of this simulator");
            self.calls().run("restore", [&] { self.simulator().restore(*snapshot.state, self.stream()); });
          },
          py::arg("snapshot"), "To a snapshot of these worlds; on CUDA without waiting.")
      .def(
          "snapshot",
          [](PySimulator& self) {
            return std::make_unique<Snapshot>(Snapshot{
                self.shared(), self.calls().run("snapshot", [&] { return self.simulator().snapshot(self.stream()); })});
          },
          "A copy of the state in the simulator's memory.")
      .def(
          "check", [](PySimulator& self) { self.calls().run("check", [&] { self.simulator().check(self.stream()); }); },
          "Waits for the work on the stream; raises pictura.Error for what a device found wrong.");
}

// A picture, and loops in C++.
void define_drawing_and_loops(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def(
          "draw", &PySimulator::draw, py::arg("world") = 0, py::arg("agent") = -1, py::kw_only(),
          py::arg("width_px") = 640, py::arg("height_px") = 480, py::arg("width_m") = 150.0f,
          R"(A world from above, uint8 [height, width, 3], on the CPU. agent: the one of that world in the middle, with its
waypoints; -1 shows the whole map. width_m: what is shown around it.)")
      .def(
          "run", [](PySimulator& self, PyController& controller, int64_t steps) { self.run(controller, steps); },
          py::arg("controller"), py::arg("steps"), "Steps with a controller for all agents. ^C ends it between steps.")
      .def(
          "time_steps",
          [](PySimulator& self, const py::object& actions, int64_t steps) {
            using Clock = std::chrono::steady_clock;
            const BorrowedArray borrowed = borrow(actions, "time_steps: actions", self.stream());
            const auto begin = Clock::now();
            self.run_steps(steps, [&] { self.simulator().step(borrowed.array(), self.stream()); });
            self.calls().run("time_steps", [&] { self.simulator().check(self.stream()); });
            return std::chrono::duration<double>(Clock::now() - begin).count();
          },
          py::arg("actions"), py::arg("steps"),
          "Seconds that so many steps with the same actions take from C++, for measurements: what step() adds is "
          "Python's.")
      .def_property_readonly(
          "geometries",
          [](PySimulator& self) {
            py::dict geometries;
            for (size_t i = 0; i < self.simulator().maps().size(); ++i) {
              const auto& map = self.simulator().maps()[i];
              geometries[py::int_(self.simulator().handles()[i])] =
                  py::cast(Geometry{std::shared_ptr<const StaticGeometry>(map, &map->geometry)});
            }
            return geometries;
          },
          py::doc("Of its maps, by the handles that its scene names them by."));
}

void define_controller(py::class_<PyController>* controller) {
  (*controller)
      .def(py::init([](const std::string& name, const PySimulator& simulator, uint64_t seed) {
             return std::make_unique<PyController>(controller_by_name(name, simulator, seed));
           }),
           py::arg("name"), py::arg("simulator"), py::arg("seed") = 0, "Raises pictura.UsageError listing the names.")
      .def_static(
          "_of", [](const ControllerInside& inside) { return std::make_unique<PyController>(inside); },
          py::arg("inside"))
      .def_static(
          "shared",
          [](const std::vector<std::pair<PyController*, py::object>>& drivers, const PySimulator& simulator) {
            return std::make_unique<PyController>(shared_controller(drivers, simulator));
          },
          py::arg("drivers"), py::arg("simulator"),
          R"(Controllers that share a simulator's slots, of (controller, mask): of two that command a slot, the later one drives.

mask: uint8 or bool [slots] in the simulator's memory, which is read at every step; None: all. Raises pictura.Error for another
array and for a controller of another simulator.)")
      .def_property_readonly("name", &PyController::name)
      .def(
          "act",
          [](PyController& self, PySimulator& simulator) {
            simulator.calls().run("act", [&] { self.act(simulator); });
            return self.lent_commands(simulator.stream());
          },
          py::arg("simulator"),
          R"(Commands for all slots, which may be changed before step_commands() takes them: NumPy's COMMAND_DTYPE [slots], or uint8
[slots, 28] on CUDA. The same memory at every call.)");
}

void bind_functions(py::module_& module) {
  module.def(
      "draw_worlds",
      [](uint64_t seed, int num_slots, int min_agents, int max_agents, int num_maps) {
        std::vector<WorldTuple> worlds;
        for (const WorldSpec& world : draw_worlds(seed, num_slots, min_agents, max_agents, num_maps)) {
          worlds.emplace_back(world.map, world.num_agents, world.global_world);
        }
        return worlds;
      },
      py::arg("seed"), py::arg("num_slots"), py::arg("min_agents"), py::arg("max_agents"), py::arg("num_maps"),
      "Worlds of sizes drawn from U{min, max} until they fill the slots; maps are taken in turn.");
  module.def("simulator_names", simulator_names, "Executors that this build knows.");
}

}  // namespace

void bind_simulator(py::module_& module) {
  bind_names(module);
  bind_step_result(module);
  py::class_<Snapshot>(module, "Snapshot", "A state that a simulator keeps in its own memory.");

  // All declared first, so that signatures can name them.
  py::class_<SimulatorInside>(module, "_SimulatorInside");
  py::class_<ControllerInside>(module, "_ControllerInside");
  py::class_<PyController> controller_class(module, "Controller", R"(
Who drives in one simulator on the CPU: 'lane' (the lane keeper), 'idm_lanes' (along lanes, behind others), 'idle' or 'random', in
worlds of recorded scenes 'log', 'inverse' or 'idm', or a policy of a pictura.PolicySession, or several of them.)");
  py::class_<PySimulator> simulator_class(module, "Simulator", R"(
Many worlds, each on one map, stepped together. Arrays have one element a slot: the controlled agents of world 0, then those
of world 1, and so on. Executors 'cpu' and 'cuda' give the same bits.

One thread at a time; several simulators are independent. The GIL is released while C++ works. On CUDA its work is put on
`stream`, calls return before it is done, and what is wrong with values is raised by check() or a later call.)");
  define_construction(&simulator_class);
  define_steps(&simulator_class);
  define_arrays(&simulator_class);
  define_totals_and_copies(&simulator_class);
  define_drawing_and_loops(&simulator_class);
  define_controller(&controller_class);
  bind_functions(module);
}

}  // namespace pictura::python
