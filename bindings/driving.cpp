// Evaluation, probes and saved policies, for the extension modules with and without torch. Their arguments and results
// are objects of the extension module pictura._pictura.
#include "pictura/bindings/driving.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "pictura/bindings/arrays.h"
#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/bindings/options.h"
#include "pictura/common/error.h"
#include "pictura/common/support/json_text.h"
#include "pictura/driving/replay_cases.h"
#include "pictura/evaluation/evaluate.h"
#include "pictura/evaluation/evaluate_scenes.h"
#include "pictura/evaluation/probes/corner.h"
#include "pictura/evaluation/probes/pedestrian.h"
#include "pictura/evaluation/probes/removal.h"
#include "pictura/evaluation/robust_protocol.h"
#include "pictura/policy/session.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/simulator_options.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#endif

namespace pictura::python {

namespace {

/// Adds each metric as (value, half width of its 95 % confidence interval).
void add_metrics(const std::vector<std::pair<std::string, Estimate>>& metrics, py::dict* row_out) {
  for (const auto& [name, estimate] : metrics) {
    (*row_out)[py::str(name)] = py::make_tuple(estimate.value, estimate.half_width_95);
  }
}

/// Adds counts and metrics of a row of evaluate() to a dict.
void add_row(const EvaluateRow& row, py::dict* row_out) {
  py::dict& d = *row_out;
  d["scenarios"] = row.scenarios;
  d["steps"] = row.steps;
  d["asked"] = row.asked;
  d["spawned"] = row.spawned;
  d["entered"] = row.entered;
  d["left"] = row.left;
  d["vehicle_episodes"] = row.vehicle_episodes;
  d["infractions"] = row.infractions;
  d["km_driven"] = row.km_driven;
  d["red_waits"] = row.red_waits;
  add_metrics(metrics_of(row), &d);
  add_metrics(rates_per_km_of(row), &d);
}

py::dict dict_of(const EvaluateReport& report) {
  py::list rows;
  for (const EvaluateRow& row : report.rows) {
    py::dict d;
    d["density"] = row.density;
    d["driver"] = row.driver.empty() ? py::object(py::none()) : py::str(row.driver);
    add_row(row, &d);
    rows.append(d);
  }
  py::dict d;
  d["rows"] = rows;
  d["seconds"] = report.seconds;
  d["agent_steps"] = report.agent_steps;
  d["policy_hash"] = report.results.setting.policy_hash;
  d["light_cycles"] = name_of(report.results.setting.light_cycles);
  d["others"] = report.results.setting.others;
  d["camera_severity"] = report.results.setting.camera_severity;
  return d;
}

py::dict dict_of(const SceneAgent& agent) {
  const auto has = [&agent](Event event) { return (agent.events & event) != 0; };
  py::dict d;
  d["scenario_id"] = agent.scenario_id;
  d["density"] = agent.density;
  d["rollout"] = agent.rollout;
  d["track_id"] = agent.track_id;
  d["type"] = to_string(agent.type);
  d["takeover_step"] = agent.takeover_step;
  d["driven_steps"] = agent.driven_steps;
  d["arrived"] = agent.arrived;
  d["collision"] = has(kEventCollision);
  d["at_fault"] = has(kEventAtFault);
  d["off_road"] = has(kEventOffRoad);
  d["distance_m"] = agent.distance_m;
  d["mean_displacement_m"] = agent.mean_displacement_m;
  d["final_displacement_m"] = agent.final_displacement_m;
  return d;
}

py::dict dict_of(const SceneEvaluation& evaluation, const std::vector<SceneAgent>& agents) {
  py::list rows, agent_dicts;
  for (const SceneRow& row : evaluation.rows) {
    py::dict d;
    d["density"] = row.density;
    d["scenes"] = row.scenes;
    d["vehicle_episodes"] = row.vehicle_episodes;
    d["km_driven"] = row.km_driven;
    add_metrics(metrics_of(row), &d);
    rows.append(d);
  }
  for (const SceneAgent& agent : agents) agent_dicts.append(dict_of(agent));
  py::dict d;
  d["rows"] = rows;
  d["agents"] = agent_dicts;
  d["scenes"] = evaluation.found;
  d["scored"] = evaluation.results.scored();
  d["without_drivers"] = evaluation.results.without_drivers;
  d["repaired_headings"] = evaluation.results.repaired_headings;
  d["faults"] = evaluation.faults();
  d["seconds"] = evaluation.seconds;
  d["agent_steps"] = evaluation.results.agent_steps();
  d["policy_hash"] = evaluation.results.setting.policy_hash;
  return d;
}

/// Returns the options of pictura.Simulator that give this configuration.
py::dict dict_of(SimulatorConfig config) {
  py::dict d;
  for (const Parameter& parameter : parameters_of("", config)) d[parameter.name.c_str()] = parameter.value;
  py::dict conditioning;
  for (int i = 0; i < kNumConditioning; ++i) {
    const ConditioningRange& range = config.conditioning[i];
    conditioning[kConditioningNames[i]] =
        range.low == range.high ? py::cast(range.low) : py::make_tuple(range.low, range.high);
  }
  d["conditioning"] = conditioning;
  return d;
}

struct SceneArguments {
  SceneEvaluateOptions options;
  std::string protocol = "womd";
  std::optional<std::string> control;
  std::optional<int> start_step, steps;
  std::optional<std::vector<double>> densities;
  py::dict rules;
  std::string rollouts;
};

template <typename Visitor>
void visit_options(SceneArguments& arguments, Visitor&& v) {
  SceneEvaluateOptions& options = arguments.options;
  v.value({"checkpoint"}, options.checkpoint);
  v.value({"scenes"}, options.scenes);
  v.value({"protocol"}, arguments.protocol);
  v.controller({"controller"}, options);
  v.value({"control"}, arguments.control);
  v.value({"start_step"}, arguments.start_step);
  v.value({"steps"}, arguments.steps);
  v.value({"densities"}, arguments.densities);
  v.value({"rules"}, arguments.rules);
  v.value({"first_scene"}, options.first_scene);
  v.value({"num_scenes"}, options.num_scenes);
  visit_options(static_cast<DriverOptions&>(options), v);
  v.value({"rollouts"}, arguments.rollouts);
  v.value({"realism"}, options.realism);
  v.callback({"on_progress"}, options.on_progress);
}

template <typename Probe>
struct ProbeArguments {
  Probe probe;
  std::string cases_file;
  CaseReplayOptions replay;
};

template <typename Probe, typename Visitor>
void visit_options(ProbeArguments<Probe>& arguments, Visitor&& v) {
  EvaluateOptions& worlds = arguments.probe.worlds;
  v.policies({"policies"}, arguments.probe);
  v.maps({"maps"}, worlds.maps);
  v.value({"agents_per_world"}, worlds.agents_per_world);
  v.value({"steps"}, worlds.steps);
  visit_options(arguments.probe, v);
  visit_options(static_cast<DriverOptions&>(worlds), v);
  visit_light_options(worlds, v);
  v.value({"cases_file"}, arguments.cases_file);
  v.value({"replay"}, arguments.replay.path);
  v.value({"case"}, arguments.replay.number);
  v.value({"cameras"}, arguments.replay.recording.cameras);
  v.callback({"on_progress"}, worlds.on_progress);
}

/// Arguments of PolicySession's constructor.
struct PolicyArguments : DriverOptions {};

template <typename Visitor>
void visit_options(PolicyArguments& arguments, Visitor&& v) {
  v.value({"checkpoint"}, arguments.checkpoint);
  visit_options(static_cast<SessionOptions&>(arguments), v);
  visit_light_options(arguments, v);
}

/// Throws UsageError if `replay` names no page, if the requested case is not below `count`, or if a policy is a
/// function, since replays open saved policies.
void check_case_replay(const CaseReplayOptions& replay, const ProbeOptions& probe, int64_t count) {
  const std::string& path = replay.path;
  if (path.empty() && (replay.number || replay.recording.cameras)) {
    fail_usage("replay: expected a file *.html for a case or cameras, got none");
  }
  if (!path.empty() && !path.ends_with(".html")) fail_usage("replay: expected a file *.html, got '{}'", path);
  for (size_t i = 0; i < probe.policies.size() && !path.empty(); ++i) {
    if (probe.make_own_policies[i]) fail_usage("replay: expected saved policies, got {}", probe.policies[i]);
  }
  if (replay.number && *replay.number < 0) fail_usage("case: expected 0 or more, got {}", *replay.number);
  check_case_number(replay, count);
}

/// Defines the Python function of a probe, which writes the requested files and returns a summary. `most` is the
/// probe's maximum number of cases, if it is known in advance.
template <typename Probe, typename Results, typename Row>
void def_probe(py::module_* module, const char* name, Results (*ask)(const Probe&),
               void (*write_cases)(const std::string&, const Results&),
               std::string (*summary_json)(const Results&, const std::vector<Row>&, const std::string&),
               std::type_identity_t<int64_t Probe::*> most, const char* doc) {
  const auto probe = [=](const ProbeArguments<Probe>& arguments) -> py::object {
    const std::string& cases_file = arguments.cases_file;
    check_case_replay(arguments.replay, arguments.probe,
                      most ? arguments.probe.*most : std::numeric_limits<int64_t>::max());
    const Results results = run_interruptible(name, arguments.probe.worlds.num_threads, {}, [&] {
      Results found = ask(arguments.probe);
      if (!cases_file.empty()) write_cases(cases_file, found);
      if (!arguments.replay.path.empty()) write_case_replay(arguments.replay, arguments.probe, found);
      return found;
    });
    return py::module_::import("json").attr("loads")(summary_json(results, summarize(results), cases_file));
  };
  def_with_options<ProbeArguments<Probe>>(module, {name, {"policies", "maps"}}, probe, doc);
}

/// Logits and values of a batch, in the memory of a session's device.
struct Outputs {
  std::vector<float> on_host;
#ifdef PICTURA_HAS_CUDA
  DeviceBuffer<float> on_device;
#endif
  Span<float> all;

  Outputs(int64_t batch, Device device) {
    const auto count = static_cast<size_t>(batch * (kNumActions + 1));
#ifdef PICTURA_HAS_CUDA
    if (!device.is_host()) {
      const DeviceGuard guard(device);
      on_device = DeviceBuffer<float>(count);
      all = {on_device.data(), count};
      return;
    }
#endif
    PICTURA_CHECK(device.is_host(), "evaluate: this build has no CUDA");
    on_host.resize(count);
    all = on_host;
  }
};

/// Controller of a session. It keeps session and renderer alive, and guards against calls of them by other threads.
class SessionController final : public Controller {
 public:
  SessionController(std::shared_ptr<PolicySession> session, std::shared_ptr<SingleCallGuard> of_session,
                    RendererInside renderer, std::unique_ptr<Controller> controller)
      : session_(std::move(session)),
        of_session_(std::move(of_session)),
        renderer_(std::move(renderer)),
        controller_(std::move(controller)) {}

  std::string_view name() const override { return controller_->name(); }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    const SingleCallGuard::Pass in_session(of_session_.get(), "the controller's session");
    std::optional<SingleCallGuard::Pass> in_renderer;
    if (renderer_.call_guard) in_renderer.emplace(renderer_.call_guard.get(), "the controller's renderer");
    controller_->act(input, mask, commands_out, stream);
  }

 private:
  std::shared_ptr<PolicySession> session_;
  std::shared_ptr<SingleCallGuard> of_session_;
  RendererInside renderer_;
  std::unique_ptr<Controller> controller_;
};

class PySession {
 public:
  PySession(const std::string& checkpoint, const SessionOptions& options)
      : session_(std::make_shared<PolicySession>(checkpoint, options)),
        calls_(options.num_threads, session_->device()) {}

  PolicySession& session() { return *session_; }

  py::object make_renderer() {
    std::shared_ptr<Renderer> renderer = calls_.run("make_renderer", [&] { return session_->make_renderer(); });
    if (!renderer) return py::none();
    return of_main("Renderer")(RendererInside{std::move(renderer), nullptr});
  }

  py::object make_controller(const py::object& simulator, const py::object& renderer, bool argmax, uint64_t seed) {
    const auto of = inside_of<SimulatorInside>(simulator, "make_controller", "Simulator").simulator;
    RendererInside drawing;
    if (!renderer.is_none()) drawing = inside_of<RendererInside>(renderer, "make_controller", "Renderer");
    ControllerInside inside;
    inside.of = of;
    inside.controller = std::make_shared<SessionController>(
        session_, calls_.call_guard(), drawing, session_->make_controller(drawing.renderer.get(), argmax, seed));
    return of_main("Controller")(inside);
  }

  py::tuple evaluate(const py::dict& observations, const Scene* scene, const py::object& views,
                     const py::object& renderer, const py::object& is_drawn) {
    const Device device = session_->device();
    std::vector<BorrowedArray> borrowed;
    PolicyInput input;
    int64_t batch = -1;
    const auto names = [] {
      std::vector<std::string> all;
      for (const ObservationArray& array : kObservationArrays) all.emplace_back(array.name);
      return all;
    };
    for (const auto& [key, value] : observations) {
      const auto name = py::cast<std::string>(key);
      borrowed.push_back(borrow(value, "evaluate: " + name, {}));
      const Array& array = borrowed.back().array();
      PICTURA_CHECK(array.shape.rank() > 0, "evaluate: {}: expected [batch, ...], got {}", name, array.text());
      if (batch < 0) batch = array.shape[0];
      bool is_known = false;
#define X(its_name, type, rows, features, part, comment)                                                     \
  if (name == #its_name) {                                                                                   \
    const Dims shape = rows == 1 && array.shape.rank() == 2 ? Dims{batch, int64_t{features}}                 \
                                                            : Dims{batch, int64_t{rows}, int64_t{features}}; \
    const Span<const type> span = array.checked<const type>("evaluate: " #its_name, shape, device);          \
    input.observations.its_name = {const_cast<type*>(span.data()), span.size()};                             \
    is_known = true;                                                                                         \
  }
      PICTURA_OBSERVATION_ARRAYS(X)
#undef X
      PICTURA_CHECK(is_known, "evaluate: expected observations by the names {}, got '{}'", fmt::join(names(), ", "),
                    name);
    }
    PICTURA_CHECK(batch >= 0, "evaluate: expected observations, got none");
    SceneBatch scene_batch;
    if (scene) {
      scene_batch = scene->batch();
      input.scene = &scene_batch;
    }
    if (!views.is_none()) {
      borrowed.push_back(borrow_structs(views, "evaluate: views", sizeof(View), {}));
      const auto bytes = borrowed.back().array().checked<const uint8_t>(
          "evaluate: views", {batch, static_cast<int64_t>(sizeof(View))}, device);
      PICTURA_CHECK(reinterpret_cast<uintptr_t>(bytes.data()) % alignof(View) == 0,
                    "evaluate: views: expected aligned memory");
      input.views = {reinterpret_cast<const View*>(bytes.data()), static_cast<size_t>(batch)};
    }
    if (!is_drawn.is_none()) {
      borrowed.push_back(borrow(is_drawn, "evaluate: is_drawn", {}));
      input.is_drawn = borrowed.back().array().checked<const uint8_t>("evaluate: is_drawn", {batch}, device);
    }
    std::optional<RendererInside> inside;
    if (!renderer.is_none()) inside = inside_of<RendererInside>(renderer, "evaluate", "Renderer");

    const auto answers = std::make_shared<Outputs>(batch, device);
    const auto count = static_cast<size_t>(batch);
    const Span<float> logits(answers->all.data(), count * kNumActions);
    const Span<float> values(answers->all.data() + count * kNumActions, count);
    calls_.run("evaluate", [&] {
      std::optional<SingleCallGuard::Pass> in_renderer;
      if (inside) in_renderer.emplace(inside->call_guard.get(), "evaluate: renderer");
      session_->evaluate(input, inside ? inside->renderer.get() : nullptr, logits, values);
    });
    return py::make_tuple(LentArray{Array(logits.data(), {batch, kNumActions}, device), answers, {}, false, "logits"},
                          LentArray{Array(values.data(), {batch}, device), answers, {}, false, "values"});
  }

 private:
  static py::object of_main(const char* type) { return py::module_::import("pictura._pictura").attr(type).attr("_of"); }

  std::shared_ptr<PolicySession> session_;
  Calls calls_;
};

py::dict dict_of(const RobustReport& report) {
  py::list rows;
  for (const RobustRow& row : report.rows) {
    py::dict d;
    d["part"] = row.condition.part;
    d["name"] = row.condition.name;
    d["not_driven"] = row.not_driven.empty() ? py::object(py::none()) : py::str(row.not_driven);
    if (!row.counts.scenarios.empty()) add_row(report.metrics(row), &d);
    rows.append(d);
  }
  py::dict pooled;
  for (const auto& [part, row] : report.pooled()) {
    py::dict d;
    add_row(row, &d);
    pooled[py::str(part)] = d;
  }
  py::dict d;
  d["rows"] = rows;
  d["pooled"] = pooled;
  d["seconds"] = report.seconds;
  d["agent_steps"] = report.agent_steps;
  d["policy_hash"] = report.setting.policy_hash;
  return d;
}

void bind_evaluation(py::module_& module) {
  def_with_options<EvaluateOptions>(
      &module, {"evaluate", {"checkpoint", "maps"}},
      [](const EvaluateOptions& options) {
        return dict_of(
            run_interruptible("evaluate", options.num_threads, {}, [&options] { return pictura::evaluate(options); }));
      },
      R"(Runs the paper's evaluation, like `pictura evaluate`, in worlds that are not used for training.

Returns a dict. `rows` has one dict for each density and driver (None: the evaluated driver), with counts, and metrics
as (value, half width of the 95 % interval). The other names are seconds, agent_steps, policy_hash, light_cycles, others
and camera_severity.

Args:
    checkpoint: File of a policy; '' with `controller`, which then drives in the paper's world.
    maps: Names, files, or ranges such as procedural:1-64.
    controller: Driver instead of the policy: 'lane', 'idm_lanes', 'random', 'idle', or a function. The function gets a
        dict of NumPy arrays [slots, ...] like pictura.Simulator.observations, and returns actions int [slots], or
        logits [slots, 12] and values [slots], on the CPU. If cameras are given (rig, or width_px and height_px), the
        dict also contains images: `rgb` uint8 [slots, cameras, 3, height, width], black for inactive agents, or rgb_0,
        rgb_1, ... for cameras of several sizes.
    densities: 'light', 'medium' and 'dense': 60, 120 and 150 agents per world.
    agents_per_world: Number of agents per world instead of the densities' numbers; 0: as in `densities`.
    others: Other drivers with their shares of vehicles, policy files or controllers, such as {'lane': 0.3,
        'other.safetensors': 0.2}. 'blind', 'phantom_braking' and 'inattentive': shares of agents that the policy drives
        while impaired.
    first_scenario: Index of the first scenario.
    scenarios: Number of scenarios per density. A scenario is one seeded world.
    steps: Steps of 0.1 s per scenario.
    argmax: Whether the policy takes its most likely action; otherwise actions are sampled.
    seed: Seed of the scenarios.
    num_threads: Number of CPU threads; 0: all.
    device: Device of the policy, 'auto', 'cpu' or 'cuda'.
    simulator: Executor of the simulator, or 'auto'.
    renderer: Name of a renderer, or 'auto'; '': as in training.
    samples: Samples per pixel of the renderer 'gl': '4' (MSAA) or '4x4' (supersampling).
    rig: File of a rig instead of the cameras of the training.
    width_px: Image width of the paper's rig; 0: as in training.
    height_px: Image height of the paper's rig; 0: as in training.
    backbone: Path of the program in policy.backbone, if it has moved since training.
    conditioning: Dict of numbers that replace values of the configuration's [evaluate.conditioning].
    average: Whether to use the average of weights in the checkpoint.
    decision_steps: Steps for which each action is held; 0: as in training.
    camera_severity: Severity of randomized cameras, 0 to 2 (docs/explanation/cameras.md).
    light_cycles: 'phases' or 'independent'; '': as in training.
    light_heads: 'as_mapped' or 'visible'; '': as in training.
    on_progress: Function that is called with the completed fraction and the remaining seconds, from a separate thread.

Raises:
    KeyboardInterrupt: The user pressed ^C.
    pictura.Error: An input is invalid; the message names file and key.

Examples:
    >>> options = {'scenarios': 1, 'steps': 20, 'agents_per_world': 8}
    >>> rows = pictura.evaluate('models/perspective.safetensors', ['procedural:1'], **options)['rows']
    >>> sorted(rows[0])[:3]
    ['active_at_end_share', 'asked', 'at_fault_collision_rate']
    >>> lane_keeper = pictura.evaluate('', ['procedural:1'], controller='lane', **options))");
  def_with_options<RobustOptions>(
      &module, {"evaluate_robust", {"checkpoint"}},
      [](const RobustOptions& options) {
        return dict_of(run_interruptible("evaluate_robust", options.num_threads, {},
                                         [&options] { return pictura::evaluate_robust(options); }));
      },
      R"(Runs the robust protocol, like `pictura evaluate --protocol robust`: a fixed set of conditions with generated towns,
other drivers and randomized cameras (docs/how-to/robust_benchmark.md).

checkpoint: file of a policy; '' with `controller`, a name or a function as for evaluate().
scenarios: scenarios per condition. Another number than the default gives a trial, not a result of the benchmark.
The other arguments are those of evaluate(). The benchmark fixes seed, conditioning and camera_severity.

Returns a dict. `rows` has one dict for each condition: part, name, not_driven (the reason if the condition does not
apply, else None), counts, and metrics as (value, half width of the 95 % interval). `pooled` has the metrics over all
conditions of 'towns', 'others', 'cameras' and 'all'. The other names are seconds, agent_steps and policy_hash. ^C
raises KeyboardInterrupt.

Examples:
    >>> report = pictura.evaluate_robust('models/perspective.safetensors', scenarios=2)  # doctest: +SKIP
    >>> report['pooled']['towns']['km_per_infraction']                                   # doctest: +SKIP
    (0.8, 0.2))");
  def_with_options<SceneArguments>(
      &module, {"evaluate_scenes", {"checkpoint", "scenes"}},
      [](SceneArguments& arguments) {
        SceneEvaluateOptions& options = arguments.options;
        SceneProtocol& protocol = options.protocol;
        protocol = scene_protocol(arguments.protocol);
        protocol.control = arguments.control.value_or(protocol.control);
        protocol.start_step = arguments.start_step.value_or(protocol.start_step);
        protocol.steps = arguments.steps.value_or(protocol.steps);
        protocol.densities = arguments.densities.value_or(protocol.densities);
        for (const auto& [name, value] : arguments.rules) {
          set_scene_rule(fmt::format("{}={}", py::cast<std::string>(name), py::cast<std::string>(py::str(value))),
                         &protocol);
        }
        std::vector<SceneAgent> agents;
        options.on_agent = [&agents](const SceneAgent& agent) { agents.push_back(agent); };
        std::optional<RolloutsFile> file;
        if (!arguments.rollouts.empty()) {
          check_rollouts(protocol);
          file.emplace(arguments.rollouts);
          options.on_rollouts = [&file](const SceneRollouts& scene) { file->write(scene); };
        }
        const SceneEvaluation evaluation = run_interruptible("evaluate_scenes", options.num_threads, {},
                                                             [&options] { return pictura::evaluate_scenes(options); });
        if (file) file->commit();
        py::dict result = dict_of(evaluation, agents);
        if (!options.realism.empty()) {
          result["realism"] = py::module_::import("json").attr("loads")(json_text(realism_json(evaluation.realism)));
        }
        return result;
      },
      R"(Runs the paper's zero-shot evaluation in recorded scenes, like `pictura evaluate --protocol`.

Returns a dict. `rows` has one dict for each density, with metrics as (value, half width of the 95 % interval). `agents`
has one dict for each driven road user in each scene, density and rollout. `realism`, if requested, is the result of
pictura.realism.score_file(). The other names are scenes, scored, without_drivers, repaired_headings (by the
rule max_first_turn_deg), faults (skipped scenes with reasons), seconds, agent_steps and policy_hash.

checkpoint: file of a policy; '' with `controller`.
scenes: files, folders, or 'FILE#K' for scene K of a file.
protocol: 'womd', 'gpudrive', 'pufferdrive2', 'pufferdrive3', 'waymax' or 'simagents'.
controller: driver instead of the policy: 'log', 'inverse', 'idm', 'idm_lanes', 'random', 'idle', or a function as in
evaluate().
control, start_step, steps, densities (shares of road users that remain), rules (dict of values): settings that replace
those of the protocol (docs/explanation/evaluation.md).
first_scene, num_scenes: range of scenes; num_scenes 0: all from the first on.
rollouts: file for the rollouts of the protocol 'simagents', in the format of the Waymo sim-agents challenge.
realism: '2024' or '2025', the version of the realism score of these rollouts (docs/explanation/realism.md). It needs no
rollouts file.
The other arguments are those of evaluate().

^C raises KeyboardInterrupt. Raises pictura.Error if no scene can be used.

Examples:
    >>> results = pictura.evaluate_scenes('models/vector.safetensors', ['validation'])   # doctest: +SKIP
    >>> results['scored'], len(results['faults'])                                        # doctest: +SKIP
    (100, 0))");
}

void bind_probes(py::module_& module) {
  def_probe(
      &module, "probe_removal", &probe_removal, &write_removal_cases, &removal_summary_json, &RemovalOptions::removals,
      R"(Measures how policies' value and braking change when one road user is removed, like `pictura probe removal`.

A case is one removal of a road user (the user) for one observing agent (the ego) in one state. Returns a dict with the
contents of the command's summary.json (docs/explanation/probes.md).

policies: checkpoints, safetensors, or functions as in evaluate(), on the CPU. The world is that of the first policy's
training, or the paper's world if the first policy is a function. A function that returns actions brakes with probability
0 or 1 and has no values (None). `replay` and the control 'untrained' need saved policies.
scenes: number of driven scenarios, which are divided equally among the policies. 0: the same number for each map and
policy, at least two per map.
sample_steps: steps between sampled states.
batch: number of cases that are computed together.
removals: total number of cases.
range_m: maximum distance of a user in metres.
control: control experiment: 'none', 'unchanged', 'permuted' or 'untrained' (docs/explanation/probes.md).
cases_file: CSV file to write, with one row for each case.
replay: page *.html to write, which plays the scene of one case and shows its images with and without the user
(docs/reference/replay.md).
case: number of the replayed case in cases_file; default: the case with the largest change in the first policy's value.
cameras: whether the replay contains the ego's images of every step.
The other arguments are those of evaluate().

^C raises KeyboardInterrupt. Raises pictura.Error, which names file and key of an invalid input.

Examples:
    >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
    >>> pictura.probe_removal(policies, maps, removals=200, cases_file='cases.csv')      # doctest: +SKIP)");
  def_probe(
      &module, "probe_pedestrian", &probe_pedestrian, &write_pedestrian_cases, &pedestrian_summary_json, nullptr,
      R"(Measures how policies' value and braking change as a pedestrian emerges from behind a vehicle and is hidden again, like `pictura
probe pedestrian`.

The pedestrian is placed at points along a path in one fixed state. The path begins behind a vehicle, which hides the
pedestrian from the ego. Returns a dict with the contents of the command's summary.json (docs/explanation/probes.md).

paths: total number of paths, each in one state.
hider_range_m: maximum distance in metres of the vehicle behind which a path begins.
min_speed_mps: minimum forward speed of the ego.
height_m: height of the pedestrian.
control: control experiment: 'none', 'unchanged' or 'untrained' (docs/explanation/probes.md).
cases_file: CSV file to write, with one row for each point of each path.
The other arguments are those of probe_removal().

^C raises KeyboardInterrupt. Raises pictura.Error, which names file and key of an invalid input.

Examples:
    >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
    >>> pictura.probe_pedestrian(policies, maps, paths=8, cases_file='paths.csv')        # doctest: +SKIP)");
  def_probe(
      &module, "probe_corner", &probe_corner, &write_corner_cases, &corner_summary_json, &CornerOptions::pairs,
      R"(Measures how policies approach blind corners with a hidden vehicle, and similar empty corners, like `pictura probe corner`.

A case is a pair of runs: one at a corner that hides a vehicle, and one at a similar empty corner. Returns a dict with
the contents of the command's summary.json (docs/explanation/probes.md).

pairs: total number of pairs.
max_distance_m: maximum distance in metres from the corner at which a policy takes over the ego.
min_speed_mps: minimum speed of the ego at the takeover, and of the hidden vehicle.
user_range_m: maximum distance in metres from the hidden vehicle to the junction.
driver: 'lane' drives the scenes until the takeover, instead of the policies.
control: control experiment: 'none', 'permuted' or 'untrained' (docs/explanation/probes.md).
batch: number of pairs that run together.
cases_file: CSV file to write, with one row for each run.
case: number of the replayed pair; default: the pair in the example figure of `pictura probe corner`.
The other arguments are those of probe_removal().

^C raises KeyboardInterrupt. Raises pictura.Error, which names file and key of an invalid input.

Examples:
    >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
    >>> pictura.probe_corner(policies, maps, pairs=20, cases_file='pairs.csv')           # doctest: +SKIP)");
}

void bind_session(py::module_& module) {
  py::class_<PySession> session(module, "PolicySession", R"(
Saved policy, with the world and cameras of its training. It computes actions from observations and images. Only one
thread at a time may use a session and the renderers that are passed to it.

Examples:
    >>> session = pictura.PolicySession('models/perspective.safetensors')
    >>> town = pictura.Map.load('procedural:3')
    >>> simulator = pictura.Simulator([town], [(0, 8)], **session.training_world())
    >>> renderer = session.make_renderer()          # None for a policy of lists
    >>> for handle, geometry in simulator.geometries.items():
    ...     renderer.upload(handle, geometry)
    >>> simulator.run(session.make_controller(simulator, renderer), steps=20)
    >>> simulator.totals()['distance_m'] > 0
    True)");
  def_init_with_options<PolicyArguments>(
      &session, {"PolicySession", {"checkpoint"}},
      [](const PolicyArguments& arguments) {
        check_process("PolicySession", arguments.num_threads, {});
        return std::make_unique<PySession>(arguments.checkpoint, arguments);
      },
      R"(checkpoint: checkpoint or safetensors file.
device: 'auto', 'cpu' or 'cuda', the device of the policy. Simulators, renderers and arrays that are passed to the
session must be on this device.
The other arguments are those of pictura.evaluate().
Raises pictura.Error, which names the file, and pictura.UsageError if the policy cannot use the given cameras.)");
  session.def_property_readonly("reads_images", [](PySession& self) { return self.session().reads_images(); })
      .def_property_readonly("rig", [](PySession& self) { return self.session().rig(); })
      .def_property_readonly("device", [](PySession& self) { return name_of(self.session().device()); })
      .def(
          "training_world", [](PySession& self) { return dict_of(self.session().training_world()); },
          "Returns the options with which pictura.Simulator(maps, worlds, **options) creates worlds like those of the "
          "training.")
      .def(
          "evaluation_world",
          [](PySession& self, int steps) { return dict_of(self.session().evaluation_world(steps)); }, py::arg("steps"),
          "Returns the options of the paper's evaluation world: episodes of `steps` steps, fixed conditioning and "
          "lights.")
      .def("make_renderer", &PySession::make_renderer,
           "Returns a pictura.Renderer for the policy's images; None if the policy reads no images. Upload the "
           "geometries of the maps to the renderer before its first use.")
      .def("evaluate", &PySession::evaluate, py::arg("observations"), py::kw_only(), py::arg("scene") = nullptr,
           py::arg("views") = py::none(), py::arg("renderer") = py::none(), py::arg("is_drawn") = py::none(),
           R"(Returns logits float32 [batch, 12] and values float32 [batch], on the session's device.

observations: dict of arrays [batch, ...], like pictura.Simulator.observations.
scene, views, renderer: needed by policies that read images. views is [batch], and the renderer is from make_renderer().
is_drawn: uint8 [batch], 0 where images are black instead of drawn; default: all images are drawn.
Raises pictura.Error, which names a missing or invalid argument.)")
      .def("make_controller", &PySession::make_controller, py::arg("simulator"), py::arg("renderer") = py::none(),
           py::arg("argmax") = true, py::arg("seed") = 0,
           R"(Returns a pictura.Controller that drives agents of a simulator with the policy.

simulator: a simulator on the session's device.
renderer: needed by policies that read images: a renderer from make_renderer(), with the simulator's geometries.
argmax: whether to take the most likely action. Otherwise actions are sampled as in training, with random numbers keyed
by seed, world, agent, episode and step.
Raises pictura.Error if the renderer or one of its geometries is missing.)");
}

}  // namespace

void bind_driving(py::module_& module) {
  // This module uses types and exceptions of pictura._pictura.
  py::module_::import("pictura._pictura");
  bind_evaluation(module);
  bind_probes(module);
  bind_session(module);
  reject_uninitialized_objects(module);
  pickle_by_new_protocols(module);
}

}  // namespace pictura::python
