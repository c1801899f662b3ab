// pictura.Simulator.
#include <optional>

#include <pybind11/stl.h>

#include "pictura/bindings/options.h"
#include "pictura/bindings/python_simulator.h"
#include "pictura/simulator/simulator_options.h"

namespace pictura::python {

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

namespace {

using WorldTuple = std::tuple<int, int, uint32_t>;  // index of the map, number of agents, global world

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
#define X(name, ...) d[#name] = t.name;
#define TERMS(name) d[#name] = dict_of_terms(t.name);
  PICTURA_TOTALS(X, X, TERMS)
#undef X
#undef TERMS
  return d;
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

void bind_step_result(py::module_& module) {
  py::class_<StepArraysOfPython>(module, "StepResult", R"(
Results of a step, one element per slot, in the simulator's memory; every step overwrites the same arrays.

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
    >>> result = simulator.step(np.full(4, pictura.IDLE_ACTION, np.int32))
    >>> result.reward.shape, result.reward_terms.shape
    ((4,), (4, 11)))")
      .def_readonly("reward", &StepArraysOfPython::reward, "float32 [slots]: reward of this step.")
      .def_readonly("terminated", &StepArraysOfPython::terminated,
                    "bool [slots]: an infraction ended the agent's episode in this step.")
      .def_readonly("truncated", &StepArraysOfPython::truncated,
                    "bool [slots]: the episode ended for another reason, so learning must bootstrap from the last "
                    "observation's value.")
      .def_readonly("valid", &StepArraysOfPython::valid,
                    "bool [slots]: the agent was active when the step began, so training may use the transition.")
      .def_readonly("refusal", &StepArraysOfPython::refusal,
                    "uint8 [slots]: reason why the agent is absent from this episode: 1 no place, 2 all places taken; "
                    "0: it is present.")
      .def_readonly("reward_terms", &StepArraysOfPython::reward_terms,
                    "float32 [slots, 11]: terms of the reward, in the order of pictura.REWARD_TERMS.")
      .def_readonly("distance_m", &StepArraysOfPython::distance_m, "float32 [slots]: distance driven in this step.");
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

// Defines the constructor, and properties that the constructor sets.
void define_construction(py::class_<PySimulator>* simulator) {
  def_init_with_options<SimulatorArguments>(
      simulator, {"Simulator", {"maps", "worlds"}},
      [](const SimulatorArguments& arguments) {
        return std::make_unique<PySimulator>(arguments.executor, arguments.config, arguments.maps,
                                             worlds_of(arguments.worlds), stream_of(arguments.stream));
      },
      R"(Creates a simulator with worlds at the start of their first episodes. Defaults are the paper's training world.

Args:
    maps: Maps of the worlds.
    worlds: A tuple (index of the map, number of agents) or (index, number, global world) for each world. The global
        world, an int, keys the world's random numbers.
    executor: 'cpu', 'cuda' or 'auto'.
    device: Memory of observations and scenes: 'cpu', 'cuda' or 'cuda:INDEX'.
    seed: Seed of all random numbers.
    num_threads: Number of CPU threads; 0: all.
    dt_s: Length of a step in seconds.
    episode_steps: Steps after which a world's episode ends.
    reset_inactive_fraction: A world's episode ends when this share of its agents is inactive; a value over 1 disables
        this.
    pedestrian_fraction: Share of pedestrians among the agents.
    cyclist_fraction: Share of cyclists among the agents.
    parked_cars: Number of parked cars in each world.
    light_cycles: 'phases': lights of a junction take turns. 'independent': each light has its own cycle.
    walls: Whether buildings stand along the roads.
    wall_seed: Random seed of the heights of walls.
    light_heads: Positions of light heads. 'as_mapped': as in the map. 'visible': heads beside or before their stop line
        are moved 10 m beyond it, 3.5 m high.
    wall_observations: Whether the entity set `walls` is observed.
    reset_at_standstill: Whether accelerations become 0 when the speed changes its sign.
    blind: Share of agents that see no other road users for some seconds. These and the next two kinds of impaired
        agents are drawn at random in each episode; their transitions are never valid.
    phantom_braking: Share of agents that brake hard for some seconds without a reason.
    inattentive: Share of agents that see no traffic lights.
    stagger_episodes: Whether episodes end after a random number of steps, so that worlds do not end together.
    fixed_lights: Whether lights are green, yellow and red for 10, 3 and 2 s, as in evaluations. Otherwise durations are
        random in each episode.
    auxiliary_observations: Whether auxiliary numbers, which no image shows, are observed.
    vector_observations: Whether the entity sets are observed.
    conditioning: A number or a range (low, high) for names in CONDITIONING_NAMES; other names have the paper's ranges.
    stream: A cudaStream_t as int; None: the legacy default stream.

Raises:
    pictura.UsageError: An argument is invalid; the message names it.
    pictura.Error: The device does not exist.)");
  (*simulator)
      .def("_inside",
           [](PySimulator& self) {
             py::object inside = py::cast(self.inside());
             // This call replaces py::keep_alive<0, 1>, in which pybind11 3.1 crashes if the arguments have wrong
             // types.
             py::detail::keep_alive_impl(inside, py::cast(&self, py::return_value_policy::reference));
             return inside;
           })
      .def_property_readonly("name", [](PySimulator& self) { return std::string(self.simulator().name()); })
      .def_property_readonly("choice", &PySimulator::choice, py::doc("Executor selected for 'auto', with the reason."))
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
          py::doc("(index of the map, number of agents, global world) of each world."))
      .def_property_readonly("num_worlds", [](PySimulator& self) { return self.simulator().worlds().size(); })
      .def_property_readonly("num_slots", [](PySimulator& self) { return self.simulator().num_slots(); })
      .def_property_readonly("seed", [](PySimulator& self) { return self.simulator().config().seed; })
      .def_property_readonly("dt_s", [](PySimulator& self) { return self.simulator().config().dt_s; })
      .def_property_readonly("episode_steps", [](PySimulator& self) { return self.simulator().config().episode_steps; })
      .def_property(
          "stream", [](const PySimulator& self) { return reinterpret_cast<intptr_t>(self.stream().handle); },
          [](PySimulator& self, const py::object& stream) { self.set_stream(stream_of(stream)); },
          py::doc("The cudaStream_t on which work is enqueued, as int; 0: the legacy default stream."));
}

// Defines methods that change the state or compute hypothetical observations.
void define_steps(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def(
          "set_worlds",
          [](PySimulator& self, const std::vector<std::shared_ptr<Map>>& maps, const py::sequence& worlds,
             uint64_t seed) { self.set_worlds(maps, worlds_of(worlds), seed); },
          py::arg("maps"), py::arg("worlds"), py::arg("seed") = 0,
          R"(Replaces all worlds by other worlds on other maps, at the start of their first episodes. Afterwards get the simulator's
arrays again: arrays from before this call remain valid memory, but later calls may overwrite them. Raises the same
errors as the constructor.)")
      .def("reset", &PySimulator::reset, py::arg("world_mask") = py::none(), py::arg("seed") = py::none(),
           R"(Starts new episodes.

world_mask: uint8 or bool [worlds] in the simulator's memory, true for worlds to reset; default: all worlds.
seed: seed of these worlds from now on; default: the simulator's seed.
Raises pictura.Error for a mask of another shape, type or device.)")
      .def("step", &PySimulator::step, py::arg("actions"),
           R"(Advances every world by one step. Returns the StepResult.

actions: int32 [slots] in the simulator's memory, in [0, 12). An action is 3 times the index of the longitudinal jerk
(-15, -4, 0, 4 m/s3) plus the index of the lateral jerk (-4, 0, 4 m/s3, left is positive). Actions of inactive agents
are ignored.
If the previous step ended a world's episode, this step starts the world's next episode instead, and its slots are not
valid.
Raises pictura.Error for an array of another shape, type or device, and for actions out of range; the state is then
unchanged.)")
      .def(
          "step_commands", &PySimulator::step_commands, py::arg("commands"),
          R"(Advances every world by one step with commands, COMMAND_DTYPE [slots]. The kinds of commands are 0: an action; 1: a
kinematic state; 2: absence for the rest of the episode; 3: the recorded state, in worlds of a pictura.Scenario. Returns
and raises the same as step().)")
      .def("set_state", &PySimulator::set_state, py::arg("slots"), py::arg("fields"),
           R"(Sets fields of agents, and updates their lanes, heights, boxes, views and observations.

slots: int32 [n], without duplicates. fields: arrays [n] or [n, numbers per agent], with names and types of
AGENT_FIELDS. All arrays must be in the simulator's memory. Raises pictura.Error, which names an invalid value. On CUDA,
invalid values raise the error in check() or a later call.)")
      .def(
          "observe", &PySimulator::observe, py::arg("queries"), py::arg("hidden") = py::none(),
          py::arg("inserted") = py::none(), py::kw_only(), py::arg("out") = py::none(),
          R"(Returns hypothetical observations, in which some boxes of the world are hidden and other boxes are inserted. Only the
entity set `partners` differs from the actual observation. The state is unchanged. pictura.make_queries() creates the
first three arguments. All arrays must be in the simulator's memory.

queries: QUERY_DTYPE [n], or uint8 [n, 24]: for each query the observing slot, its ranges [begin, end) in `hidden` and
`inserted`, and leaves_gaps. If leaves_gaps is 0, boxes further away replace hidden partners; if it is 1, rows of zeros
replace them.
hidden: int32 [m], indices into the scene's boxes.
inserted: INSERTED_DTYPE [k], or uint8 [k, 40]: a box of BOX_DTYPE and its speed_mps.
out: arrays [n, ...] for the results, with the names of `observations`; default: new arrays.
Returns out. Raises pictura.Error, which names an invalid array or query; then nothing is written. On CUDA, invalid
queries raise the error in check() or a later call.)");
}

// Defines the arrays of the current state.
void define_arrays(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def_property_readonly("observations", &PySimulator::observations,
                             py::doc("Observations of the current state, a dict of arrays [slots, ...]: ego, partners, "
                                     "lanes, boundaries, controls, walls, set_counts, conditioning, waypoints."))
      .def_property_readonly(
          "state", &PySimulator::state,
          py::doc("Fields of the agents, a dict of read-only arrays [slots] or [slots, numbers per agent]."))
      .def_property_readonly("scene", &PySimulator::scene, py::doc("Scene of all worlds, for renderers."))
      .def_property_readonly(
          "views", [](PySimulator& self) { return self.lend_structs<View>(self.simulator().views(), "views"); },
          py::doc("View of each slot for render(): uint8 [slots, 60] with the fields of VIEW_DTYPE."))
      .def_property_readonly(
          "episode_step",
          [](PySimulator& self) { return self.lend_span(self.simulator().episode_step(), "episode_step"); },
          py::doc("int32 [worlds]: number of completed steps in the current episode."))
      .def_property_readonly(
          "episode_index",
          [](PySimulator& self) { return self.lend_span(self.simulator().episode_index(), "episode_index"); },
          py::doc("int32 [worlds]: index of the current episode."))
      .def_property_readonly(
          "episode_over",
          [](PySimulator& self) { return self.lend_span(self.simulator().episode_over(), "episode_over", true); },
          py::doc("bool [worlds]: whether the episode has ended; the next step then begins the next episode."))
      .def_property_readonly(
          "world_of_slot",
          [](PySimulator& self) { return self.lend_span(self.simulator().slots().world_of_slot, "world_of_slot"); },
          py::doc("int32 [slots]: index of the slot's world."))
      .def_property_readonly(
          "agent_of_slot",
          [](PySimulator& self) { return self.lend_span(self.simulator().slots().agent_of_slot, "agent_of_slot"); },
          py::doc("int32 [slots]: index of the slot's agent in its world."));
}

// Defines methods that return counts or copies of the state.
void define_totals_and_copies(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def(
          "spawn_report",
          [](PySimulator& self) {
            return report_of(
                self.calls().run("spawn_report", [&] { return self.simulator().spawn_report(self.stream()); }));
          },
          "Returns a dict of the numbers of requested, spawned, refused, entered and left agents and of parked cars. "
          "Waits for the stream.")
      .def(
          "totals",
          [](PySimulator& self) {
            return dict_of(
                self.calls().run("totals", [&] { return SimulatorTotals(self.simulator().totals(self.stream())); }));
          },
          "Returns a dict of counts and sums since construction. `reward_terms` is a dict. Waits for the stream.")
      .def(
          "state_hash",
          [](PySimulator& self) {
            return self.calls().run("state_hash", [&] { return self.simulator().state_hash(self.stream()); });
          },
          "Returns a 64-bit hash of the complete state, which is equal on all executors. Waits for the stream.")
      .def(
          "save",
          [](PySimulator& self) {
            const auto bytes = self.calls().run("save", [&] { return self.simulator().save(self.stream()); });
            return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
          },
          "Returns the complete state as bytes, from which any executor can resume exactly. Waits for the stream.")
      .def(
          "restore",
          [](PySimulator& self, const py::bytes& saved) {
            const std::string_view bytes = saved;
            self.calls().run("restore", [&] {
              self.simulator().restore(
                  Span<const uint8_t>(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()), self.stream());
            });
          },
          py::arg("saved"),
          "Restores a state of save(). Raises pictura.Error if the state is of other worlds; the message names the "
          "difference.")
      .def(
          "restore",
          [](PySimulator& self, const Snapshot& snapshot) {
            PICTURA_CHECK(snapshot.of == self.shared(), "restore: expected a snapshot of this simulator");
            self.calls().run("restore", [&] { self.simulator().restore(*snapshot.state, self.stream()); });
          },
          py::arg("snapshot"), "Restores a snapshot of these worlds. On CUDA it does not wait for the stream.")
      .def(
          "snapshot",
          [](PySimulator& self) {
            return std::make_unique<Snapshot>(Snapshot{
                self.shared(), self.calls().run("snapshot", [&] { return self.simulator().snapshot(self.stream()); })});
          },
          "Returns a copy of the state. The copy is in the simulator's memory.")
      .def(
          "check", [](PySimulator& self) { self.calls().run("check", [&] { self.simulator().check(self.stream()); }); },
          "Waits for the work on the stream. Raises pictura.Error for errors that CUDA kernels have found.");
}

// Defines methods that draw a world or take many steps.
void define_drawing_and_loops(py::class_<PySimulator>* simulator) {
  (*simulator)
      .def(
          "draw", &PySimulator::draw, py::arg("world") = 0, py::arg("agent") = -1, py::kw_only(),
          py::arg("width_px") = 640, py::arg("height_px") = 480, py::arg("width_m") = 150.0f,
          R"(Draws a world from above on the CPU. Returns uint8 [height, width, 3]. agent: agent of this world in the middle, with
its waypoints; -1: the whole map. width_m: width of the drawn area in metres, if there is an agent.)")
      .def(
          "run", [](PySimulator& self, PyController& controller, int64_t steps) { self.run(controller, steps); },
          py::arg("controller"), py::arg("steps"),
          "Advances every world by `steps` steps, with a controller for all agents. ^C ends the call between two "
          "steps.")
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
          R"(Executes steps with the same actions from C++. Returns the duration in seconds, for measurements of Python's overhead in
step().)")
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
          py::doc("Geometries of the maps, by their handles in the scene."));
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
      R"(
Draws random worlds until they fill the slots. The number of agents of a world is uniform in [min_agents, max_agents].
Worlds use the maps in turn. Returns (index of the map, number of agents, global world) of each world.

Examples:
    >>> worlds = pictura.draw_worlds(seed=1, num_slots=100, min_agents=5, max_agents=40, num_maps=2)
    >>> sum(agents for _, agents, _ in worlds)
    100)");
  module.def("simulator_names", simulator_names, R"(
Returns the executors of this build.

Examples:
    >>> 'cpu' in pictura.simulator_names()
    True)");
}

}  // namespace

void bind_simulator(py::module_& module) {
  bind_names(module);
  bind_step_result(module);
  py::class_<Snapshot>(module, "Snapshot", R"(
Copy of a simulator's state in the simulator's memory, from Simulator.snapshot().

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
    >>> before, snapshot = simulator.state_hash(), simulator.snapshot()
    >>> simulator.run(pictura.Controller('lane', simulator), 10)
    >>> simulator.restore(snapshot)
    >>> simulator.state_hash() == before
    True)");

  // All classes are declared first, so that signatures can name them.
  py::class_<SimulatorInside>(module, "_SimulatorInside");
  py::class_<ControllerInside>(module, "_ControllerInside");
  py::class_<PyController> controller_class(module, "Controller", R"(
Controller of the agents in one simulator on the CPU.

Controllers by name are 'lane' (follows lanes), 'idm_lanes' (follows lanes and keeps a distance to vehicles ahead),
'idle' and 'random', and in recorded scenes 'log', 'inverse' and 'idm'. pictura.PolicySession makes controllers with a
policy; shared() combines several controllers.

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
    >>> simulator.run(pictura.Controller('lane', simulator), steps=50)
    >>> commands = pictura.Controller('idle', simulator).act(simulator)
    >>> commands['action'].shape
    (8,))");
  py::class_<PySimulator> simulator_class(module, "Simulator", R"(
Many worlds, each on one map, which advance together. Arrays have one element for each slot: first for the controlled
agents of world 0, then for the controlled agents of world 1, and so on. Results of the executors 'cpu' and 'cuda' are
equal bit for bit.

Only one thread at a time may use a simulator; different simulators are independent. The GIL is released while C++ code
runs. On CUDA, work is enqueued on `stream`, and calls return before the work is done. Invalid values then raise an
error in check() or a later call.

Examples:
    >>> town = pictura.Map.load('procedural:3')
    >>> simulator = pictura.Simulator([town], [(0, 16)] * 4, seed=1)          # four worlds of sixteen agents
    >>> result = simulator.step(np.full(simulator.num_slots, pictura.IDLE_ACTION, np.int32))
    >>> result.reward.numpy().shape, simulator.observations['lanes'].numpy().shape
    ((64,), (64, 80, 7)))");
  define_construction(&simulator_class);
  define_steps(&simulator_class);
  define_arrays(&simulator_class);
  define_totals_and_copies(&simulator_class);
  define_drawing_and_loops(&simulator_class);
  define_controller(&controller_class);
  bind_functions(module);
}

}  // namespace pictura::python
