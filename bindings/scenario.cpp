// pictura.Scenario and worlds from recorded scenes.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/bindings/scene_arrays.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/simulator/controllers/inverse_actions.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/simulator/scene_recorder.h"

namespace pictura::python {

RecordedScene::RecordedScene(std::shared_ptr<const Scenario> scenario, std::string source, int32_t start_step,
                             bool recorded_lights)
    : Map({scenario, &scenario->map}, std::move(source)),
      scenario_(std::move(scenario)),
      start_step_(start_step),
      recorded_lights_(recorded_lights) {
  if (start_step < 0 || start_step >= scenario_->num_steps) {
    fail_usage("scene {}: start_step: expected a step of its recording, in [0, {}), got {}", scenario_->id,
               scenario_->num_steps, start_step);
  }
}

std::function<std::shared_ptr<const CompiledMap>()> RecordedScene::compilation(const MapOptions& options) const {
  MapOptions compiled = options;
  compiled.recorded_lights = recorded_lights_;
  return [scenario = scenario_, compiled, start_step = start_step_] {
    return compile_scenario(scenario, compiled, start_step);
  };
}

namespace {

std::shared_ptr<RecordedScene> load_scene(const std::string& name, int32_t start_step) {
  auto scenario = run_interruptibly("Scenario.load", 1, {},
                                    [name] { return std::make_shared<const Scenario>(load_scenario(name)); });
  return std::make_shared<RecordedScene>(std::move(scenario), name, start_step);
}

struct SceneNumbers {
  double dt_s, tolerance_m;
  std::optional<int32_t> current_step, sdc_track;
  std::optional<std::array<double, 3>> origin_m;
};

std::shared_ptr<RecordedScene> scene_of_arrays(const SceneArrays& arrays, const SceneNumbers& numbers,
                                               const std::string& id) {
  constexpr int32_t kHistorySteps = 10;  // default for files that do not define it
  LoggedScene scene = scene_from_arrays(arrays);
  scene.id = scene.name = id;
  scene.dt_s = numbers.dt_s;
  scene.current_step = numbers.current_step.value_or(std::min(kHistorySteps, scene.num_steps - 1));
  if (numbers.sdc_track && (*numbers.sdc_track < 0 || *numbers.sdc_track >= static_cast<int>(scene.tracks.size()))) {
    fail_usage("sdc_track: expected a track in [0, {}), got {}", scene.tracks.size(), *numbers.sdc_track);
  }
  scene.sdc_track = numbers.sdc_track.value_or(-1);
  if (!(numbers.tolerance_m >= 0 && numbers.tolerance_m <= 1)) {
    fail_usage("tolerance_m: expected a number in [0, 1], got {}", numbers.tolerance_m);
  }
  scene.tolerance_m = numbers.tolerance_m;
  if (numbers.origin_m) {
    for (const double value : *numbers.origin_m) {
      if (!std::isfinite(value)) fail_usage("origin_m: expected finite numbers, got {}", value);
    }
    scene.origin_m = Eigen::Vector3d(numbers.origin_m->data());
  }
  auto scenario = run_interruptibly("Scenario.from_arrays", 1, {}, [scene = std::move(scene)]() mutable {
    return std::make_shared<const Scenario>(make_scenario(std::move(scene)));
  });
  return std::make_shared<RecordedScene>(std::move(scenario), id, 0);
}

/// Returns the arguments of from_arrays() that give this scenario.
py::dict arrays_of_scene(const Scenario& scenario) {
  py::dict d = to_arrays(scene_of_scenario(scenario));
  d["dt_s"] = scenario.dt_s;
  d["current_step"] = scenario.current_step;
  d["sdc_track"] = scenario.sdc_track < 0 ? py::object(py::none()) : py::int_(scenario.sdc_track);
  d["id"] = scenario.id;
  d["origin_m"] = scenario.map.origin_m;
  d["tolerance_m"] = 0.0;
  return d;
}

py::dict facts_of_scene(const Scenario& scenario) {
  const ScenarioFacts facts = pictura::facts_of(scenario);
  py::dict d = facts_of(scenario.map.facts);
  d["vehicles"] = facts.vehicles;
  d["moving_vehicles"] = facts.moving_vehicles;
  d["pedestrians"] = facts.pedestrians;
  d["cyclists"] = facts.cyclists;
  d["others"] = facts.others;
  d["tracks_with_gaps"] = facts.tracks_with_gaps;
  d["tracks_to_predict"] = scenario.tracks_to_predict.size();
  d["objects_of_interest"] = scenario.objects_of_interest.size();
  d["recorded_lights"] = scenario.lights.size();
  d["recorded_light_states"] = facts.recorded_light_states;
  return d;
}

/// Copies `count` numbers, which are contiguous in each item from member `first` on, to an array.
template <typename T, typename Item>
py::array_t<T> copied(const std::vector<py::ssize_t>& shape, const std::vector<Item>& items, const T Item::* first,
                      size_t count) {
  py::array_t<T> array(shape);
  T* out = array.mutable_data();
  for (const Item& item : items) out = std::copy_n(&(item.*first), count, out);
  return array;
}

py::dict tracks_of_scene(const Scenario& scenario) {
  const auto tracks = static_cast<py::ssize_t>(scenario.tracks.size()), steps = py::ssize_t{scenario.num_steps};
  py::dict d;
  d["id"] = copied<int64_t>({tracks}, scenario.tracks, &RecordedTrack::id, 1);
  py::array_t<uint8_t> type(tracks), valid({tracks, steps});
  for (py::ssize_t i = 0; i < tracks; ++i) {
    type.mutable_at(i) = static_cast<uint8_t>(scenario.tracks[i].type);
  }
  std::copy(scenario.valid.begin(), scenario.valid.end(), valid.mutable_data());
  d["type"] = type;
  d["valid"] = valid.attr("view")("bool");
  static_assert(offsetof(RecordedTrack, height_m) == offsetof(RecordedTrack, length_m) + 2 * sizeof(float));
  d["size_m"] = copied<float>({tracks, 3}, scenario.tracks, &RecordedTrack::length_m, 3);
  py::array_t<float> position({tracks, steps, py::ssize_t{3}}), velocity({tracks, steps, py::ssize_t{2}});
  float *xyz = position.mutable_data(), *xy = velocity.mutable_data();
  for (const TrackState& state : scenario.states) {
    for (const float value : {state.position_m.x, state.position_m.y, state.position_m.z}) *xyz++ = value;
    for (const float value : {state.velocity_mps.x, state.velocity_mps.y}) *xy++ = value;
  }
  d["position_m"] = position;
  d["velocity_mps"] = velocity;
  d["heading_rad"] = copied<float>({tracks, steps}, scenario.states, &TrackState::heading_rad, 1);
  return d;
}

py::list notes_of(const Scenario& scenario) {
  py::list notes;
  for (const ConversionNote& note : scenario.notes) notes.append(py::make_tuple(note.what, note.count, note.first));
  return notes;
}

py::array_t<uint8_t> mask_of(const std::vector<uint8_t>& mask) {
  return py::array_t<uint8_t>(static_cast<py::ssize_t>(mask.size()), mask.data());
}

/// Returns options of pictura.Simulator: `options`, in which the settings of scene_config() replace others.
py::dict world_of(const RecordedScene& scene, const py::kwargs& options) {
  const SimulatorConfig config = scene_config(*scene.scenario(), scene.start_step());
  py::dict d(options);
  d["dt_s"] = config.dt_s;
  d["episode_steps"] = config.episode_steps;
  d["reset_inactive_fraction"] = config.reset_inactive_fraction;
  d["parked_cars"] = config.parked_cars;
  d["walls"] = config.walls;
  py::dict conditioning;
  if (d.contains("conditioning")) conditioning.attr("update")(d["conditioning"]);  // a copy, not the caller's dict
  for (const Conditioning which : {Conditioning::throttle, Conditioning::steer, Conditioning::acceleration}) {
    conditioning[kConditioningNames[static_cast<size_t>(which)]] = config.conditioning[static_cast<size_t>(which)].low;
  }
  d["conditioning"] = conditioning;
  return d;
}

py::dict inverse_actions_of(RecordedScene& scene, int num_threads) {
  MapOptions options;
  options.walls = false;
  const float dt_s = scene_config(*scene.scenario(), scene.start_step()).dt_s;
  const InverseActions found = run_interruptibly(
      "Scenario.inverse_actions", num_threads, {},
      [map = scene.compiled(options), dt_s, num_threads] { return find_inverse_actions(*map, dt_s, num_threads); });
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(scene.scenario()->tracks.size()), found.num_steps};
  py::dict d;
  d["actions"] = py::array_t<int32_t>(shape, found.actions.data());
  d["is_followed"] = py::array_t<uint8_t>(shape, found.is_followed.data()).attr("view")("bool");
  d["error_m"] = py::array_t<float>(shape, found.error_m.data());
  return d;
}

class PySceneRecorder final : public StepObserver {
 public:
  PySceneRecorder(SimulatorInside inside, int world) : inside_(std::move(inside)) {
    inside_.run("SceneRecorder", [&] { recorder_.emplace(*inside_.simulator, world); });
  }

  void after_step(const StepResult& result) override { recorder_->after_step(result); }
  void after_reset(Span<const uint8_t> world_mask) override { recorder_->after_reset(world_mask); }

  int num_steps() const { return recorder_->num_steps() - 1; }
  std::shared_ptr<RecordedScene> scenario(const std::string& id, int self_agent) {
    std::shared_ptr<const Scenario> scenario;
    inside_.run("scenario", [&] { scenario = std::make_shared<const Scenario>(recorder_->scenario(id, self_agent)); });
    std::string source = scenario->id;
    return std::make_shared<RecordedScene>(std::move(scenario), std::move(source), 0);
  }

 private:
  SimulatorInside inside_;
  std::optional<SceneRecorder> recorder_;
};

}  // namespace

void bind_scenarios(py::module_& module) {
  py::class_<RecordedScene, Map, std::shared_ptr<RecordedScene>>(module, "Scenario", R"(
Recorded scene: a map, the tracks of all road users, and the recorded traffic lights. A scenario is immutable.

A simulator uses a scenario as the map of a world. The agents of this world are the tracks, in the same order, from
`start_step` on: pictura.Simulator([scene], [(0, scene.num_tracks)], **scene.world()). The controller 'log' and commands
of kind 3 replay the tracks.

Examples:
    >>> scene = pictura.Scenario.load('drive.scenario')            # or FILE.tfrecord#7, FILE.json, a folder
    >>> simulator = pictura.Simulator([scene], [(0, scene.num_tracks)], **scene.world())
    >>> simulator.run(pictura.Controller('log', simulator), 10)    # all as recorded
    >>> scene.tracks()['position_m'].shape == (scene.num_tracks, scene.num_steps, 3)
    True)")
      .def_static(
          "load", load_scene, py::arg("name"), py::kw_only(), py::arg("start_step") = 0,
          R"(Loads a scene by name: FILE.json, FILE.bin, FILE.scenario, a file with '.tfrecord' in its name, or a folder of such
files. A suffix '#7' or '#SCENARIO_ID' selects one of several scenes.

start_step: step of the recording at which episodes begin.
Raises pictura.Error, which names file, record and field, and pictura.UsageError if the scene or step does not exist.)")
      .def_static(
          "from_arrays",
          [](const py::dict& tracks, const py::dict& lanes, const std::optional<py::dict>& lines,
             const std::optional<py::dict>& edges, const std::optional<py::dict>& crosswalks,
             const std::optional<py::dict>& stop_signs, const std::optional<py::dict>& lights, double dt_s,
             std::optional<int32_t> current_step, std::optional<int32_t> sdc_track, const std::string& id,
             std::optional<std::array<double, 3>> origin_m, double tolerance_m) {
            return scene_of_arrays({tracks, lanes, lines, edges, crosswalks, stop_signs, lights},
                                   {dt_s, tolerance_m, current_step, sdc_track, origin_m}, id);
          },
          py::arg("tracks"), py::arg("lanes"), py::kw_only(), py::arg("lines") = py::none(),
          py::arg("edges") = py::none(), py::arg("crosswalks") = py::none(), py::arg("stop_signs") = py::none(),
          py::arg("lights") = py::none(), py::arg("dt_s") = 0.1, py::arg("current_step") = py::none(),
          py::arg("sdc_track") = py::none(), py::arg("id") = "", py::arg("origin_m") = py::none(),
          py::arg("tolerance_m") = 0.01,
          R"(Creates a scene from dicts of NumPy arrays, or of objects that NumPy converts to arrays.

Lengths are in metres. Positions are float64 in any frame. Polylines are given by two arrays: points float64 [P, 3], the
points of all polylines one after the other, and begin int32 [N + 1], the index of each polyline's first point, followed
by P. Lists of ids are given in the same way, for example by lanes and lanes_begin.

Args:
    tracks: id int64 [T]; type [T], indices into pictura.TRACK_TYPES; size_m [T, 3], length, width and height; valid
        bool [T, S]; position_m [T, S, 3], centre of the box's foot; heading_rad [T, S]; velocity_mps [T, S, 2]. States
        that are not valid may contain any numbers.
    lanes: points and begin of centre lines; id int64 [N], 0 or more; type [N], indices into pictura.LANE_TYPES.
        Optional: speed_limit_mps [N], 0 if unknown; width_m [P], all 0 along a lane of unknown width; in_junction bool
        [N]; entries and exits, ids of linked lanes, with entries_begin and exits_begin [N + 1]; left_neighbor and
        right_neighbor [N], ids of lanes of the same direction, or -1. Without entries and exits, lanes are linked where
        their ends coincide.
    lines: points, begin, and type [N], indices into pictura.LINE_TYPES.
    edges: points and begin of road edges, with the road on their left.
    crosswalks: points and begin of outlines.
    stop_signs: position_m [N, 3]; lanes, ids of the controlled lanes, with lanes_begin [N + 1].
    lights: lanes, ids of the controlled lanes, with lanes_begin [L + 1]; states [L, S], indices into
        pictura.LIGHT_STATES; stop_lines [L, 2, 3], by default across the beginning of the lanes.
    dt_s: Time between states in seconds.
    current_step: Step of the present, at which the history ends. None: 10, or the last step if there are fewer.
    sdc_track: Index of the self-driving car's track.
    id: Id of the scene.
    origin_m: Origin of the map's frame, in which positions are rounded to float32. None: the middle of lanes and edges.
    tolerance_m: Maximum deviation of polylines when points are removed. 0 keeps all points.

Raises:
    pictura.UsageError: An array is invalid; the message names the array and the element.
    pictura.Error: The arrays do not form a scene.)")
      .def(
          "to_arrays", [](const RecordedScene& self) { return arrays_of_scene(*self.scenario()); },
          R"(Returns a dict of arguments with which pictura.Scenario.from_arrays(**arrays) creates the same scene.

The result does not contain tracks to predict, tracks marked for replay, walls, parking spaces, signs other than stop
signs, widths of paint, and the data for bit-exact replay of a saved run.)")
      .def(
          "starting_at",
          [](const RecordedScene& self, int32_t start_step) {
            return std::make_shared<RecordedScene>(self.scenario(), self.source(), start_step, self.recorded_lights());
          },
          py::arg("start_step"),
          R"(Returns the same scene with another start step, without copying data.

Raises pictura.UsageError if the scene does not have this step.)")
      .def(
          "with_recorded_lights",
          [](const RecordedScene& self) {
            return std::make_shared<RecordedScene>(self.scenario(), self.source(), self.start_step(), true);
          },
          "Returns the same scene with its recorded lights enabled: worlds draw and observe them, and crossing a red "
          "light is an infraction.")
      .def_property_readonly(
          "start_step", [](const RecordedScene& self) { return self.start_step(); },
          py::doc("Step of the recording at which episodes begin."))
      .def_property_readonly(
          "id", [](const RecordedScene& self) { return self.scenario()->id; },
          py::doc("Id of the recording, such as '637f20cafde22ff8'; may be empty."))
      .def_property_readonly(
          "format", [](const RecordedScene& self) { return self.scenario()->format; },
          py::doc("File format: 'womd', 'gpudrive', 'pufferdrive v1', ..."))
      .def_property_readonly(
          "num_tracks", [](const RecordedScene& self) { return self.scenario()->tracks.size(); },
          py::doc("Number of tracks, and of agents in each of the scene's worlds."))
      .def_property_readonly(
          "num_steps", [](const RecordedScene& self) { return self.scenario()->num_steps; },
          py::doc("Number of states of each track, from the recording's first step on."))
      .def_property_readonly(
          "dt_s", [](const RecordedScene& self) { return self.scenario()->dt_s; }, py::doc("Seconds between states."))
      .def_property_readonly(
          "current_step", [](const RecordedScene& self) { return self.scenario()->current_step; },
          py::doc("Step of the present: the last step of the history that a predictor may use."))
      .def_property_readonly(
          "sdc_track",
          [](const RecordedScene& self) -> std::optional<int32_t> {
            const int32_t track = self.scenario()->sdc_track;
            return track < 0 ? std::nullopt : std::optional(track);
          },
          py::doc("Index of the self-driving car's track; None if the file does not mark it."))
      .def_property_readonly(
          "facts", [](const RecordedScene& self) { return facts_of_scene(*self.scenario()); },
          py::doc("Dict of the map's counts and lengths, and of counts of tracks and lights, as `pictura map` prints "
                  "them."))
      .def_property_readonly(
          "notes", [](const RecordedScene& self) { return notes_of(*self.scenario()); },
          py::doc("Elements that the conversion of the file dropped or changed: a tuple (kind, count, place of the "
                  "first) for each kind."))
      .def(
          "tracks", [](const RecordedScene& self) { return tracks_of_scene(*self.scenario()); },
          R"(Returns copies of the tracks as a dict of NumPy arrays.

id int64 [tracks]: ids in the file. type uint8 [tracks]: indices into pictura.TRACK_TYPES. size_m float32 [tracks, 3]:
length, width, height. valid bool [tracks, steps]: whether the state is recorded. position_m float32 [tracks, steps, 3]:
centre of the box's foot in the map's frame. heading_rad [tracks, steps]. velocity_mps [tracks, steps, 2]: 0 if
the state is not valid.)")
      .def(
          "mask",
          [](const RecordedScene& self, const std::string& words, bool absent) {
            const Scenario& scenario = *self.scenario();
            return mask_of(absent ? tracks_of(scenario, words) : tracks_of(scenario, words, self.start_step()));
          },
          py::arg("words"), py::kw_only(), py::arg("absent") = false,
          R"(Returns a mask uint8 [tracks], which is 1 for selected tracks.

words: comma-separated list of self (the self-driving car), vehicles (all other vehicles), others (all non-vehicles),
all, tracks_to_predict, objects_of_interest, and ids of tracks.
absent: also selects tracks that are absent at start_step.
Raises pictura.UsageError for an unknown word, and if no track is selected.)")
      .def(
          "world", world_of,
          R"(Returns the options for pictura.Simulator([scene], worlds, **options): the recording's time step, episodes from
start_step to the end of the recording, no walls, no parked cars, no early end of episodes, and unscaled dynamics.

Other options in kwargs are kept, for example those of a pictura.PolicySession: scene.world(**session.training_world()).)")
      .def(
          "save",
          [](const RecordedScene& self, const std::string& path) {
            const GilRelease no_gil;
            write_scene_file(path, *self.scenario());
          },
          py::arg("path"),
          R"(Writes the scene to a file *.scenario, completely or not at all. load() restores exactly the same scene.

Raises pictura.UsageError for another file extension, and pictura.Error if the file cannot be written.)")
      .def(
          "draw",
          [](const RecordedScene& self, int width_px, int height_px) {
            return draw(*self.road(), width_px, height_px, self.scenario().get(), self.start_step());
          },
          py::arg("width_px") = 1024, py::arg("height_px") = 1024,
          R"(Draws the scene from above: the paths of all tracks, and the road users at start_step.

Returns uint8 [height, width, 3], with north at the top. Sizes are from 16 to 8192 px.)")
      .def(
          "inverse_actions", inverse_actions_of, py::arg("num_threads") = 0,
          R"(Computes the actions with which the simulator's dynamics follow the recording most closely. Returns a dict of
NumPy arrays.

The arrays are [tracks, steps from start_step on], with a value for the step after each state. actions int32: the
action. is_followed bool: whether the states before and after the step are recorded. error_m float32: distance between
the simulated and the recorded position after the step.
num_threads: number of CPU threads; 0: all.)")
      .def("__repr__", [](const RecordedScene& self) {
        const Scenario& scenario = *self.scenario();
        return fmt::format("<pictura.Scenario {} ({}): {} tracks, {} steps, from step {}>", scenario.id,
                           scenario.format, scenario.tracks.size(), scenario.num_steps, self.start_step());
      });

  py::class_<PySceneRecorder, std::shared_ptr<PySceneRecorder>>(module, "SceneRecorder", R"(
Records the current episode of one world as a scene. The simulator must be on the CPU. While the recorder exists, it
records every step of the simulator, by any function.

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
    >>> recorder = pictura.SceneRecorder(simulator)
    >>> simulator.run(pictura.Controller('lane', simulator), 30)
    >>> recorder.scenario(id='my drive', self_agent=0).save('mine.scenario')
    >>> recorder.num_steps
    30)")
      .def(py::init([](const py::object& simulator, int world) {
             auto inside = inside_of<SimulatorInside>(simulator, "SceneRecorder", "Simulator");
             const auto watch = inside.watch;
             auto recorder = std::make_shared<PySceneRecorder>(std::move(inside), world);
             watch(recorder);
             return recorder;
           }),
           py::arg("simulator"), py::kw_only(), py::arg("world") = 0, py::keep_alive<1, 2>(),
           "Raises pictura.UsageError if the world does not exist or the simulator is on CUDA.")
      .def_property_readonly("num_steps", &PySceneRecorder::num_steps, "Number of recorded steps.")
      .def(
          "scenario", &PySceneRecorder::scenario, py::kw_only(), py::arg("id") = "", py::arg("self_agent") = -1,
          R"(Returns the pictura.Scenario recorded so far. Its tracks are the controlled agents and the parked cars of the world; a
track's id is the index of its box in the world. The world's lights are its recorded lights.

self_agent: agent whose track is marked as the self-driving car; -1: none. Raises pictura.UsageError for an agent that
was never present.)");
  py::list types;
  for (int i = 0; i <= static_cast<int>(TrackType::other); ++i) types.append(to_string(static_cast<TrackType>(i)));
  module.attr("TRACK_TYPES") = py::tuple(types);
  bind_scene_names(module);
}

}  // namespace pictura::python
