// Recordings of a world as replays, and live views of a world in a browser.
#include <optional>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/commit.h"
#include "pictura/common/error.h"
#include "pictura/replay/file.h"
#include "pictura/replay/gallery.h"
#include "pictura/replay/live_view.h"
#include "pictura/replay/mcap.h"
#include "pictura/replay/recorder.h"
#include "pictura/version.h"

namespace pictura::python {

namespace {

RendererConfig cameras_of(const std::optional<Rig>& rig) {
  RendererConfig config;
  if (rig) config.rig = *rig;
  return config;
}

/// Returns the origin of a replay, with the command line of this Python process.
ReplayOrigin origin_of(const std::string& policy) {
  ReplayOrigin origin{.commit = PICTURA_COMMIT, .version = PICTURA_VERSION, .policy = policy, .policy_hash = policy};
  for (const py::handle word : py::module_::import("sys").attr("argv")) {
    origin.command += (origin.command.empty() ? "python " : " ") + std::string(py::str(word));
  }
  return origin;
}

/// Converts the logits, float32 [actions], and the value of the followed agent for the next step.
ReplayDecision decision_of_python(const py::array_t<float, py::array::c_style | py::array::forcecast>& logits,
                                  float value) {
  PICTURA_CHECK(logits.ndim() == 1 && logits.size() == kNumActions,
                "decide: logits: expected [{}], got {} numbers in {} dimensions", kNumActions, logits.size(),
                logits.ndim());
  return decision_of(Span<const float>(logits.data(), static_cast<size_t>(logits.size())), value);
}

class PyRecorder final : public StepObserver {
 public:
  PyRecorder(SimulatorInside inside, const RecorderOptions& options)
      : inside_(std::move(inside)), followed_(options.followed) {
    inside_.run("Recorder", [&] { recorder_.emplace(*inside_.simulator, options); });
  }

  void before_step(Span<const Command> commands) override {
    if (recorder_) recorder_->before_step(commands);
  }
  void after_step(const StepResult& result) override {
    if (recorder_) recorder_->after_step(result);
  }
  void after_reset(Span<const uint8_t> world_mask) override {
    if (recorder_) recorder_->after_reset(world_mask);
  }

  void decide(const ReplayDecision& decision) {
    if (followed_ < 0) fail_usage("decide: the recorder follows no agent");
    if (recorder_) recorder_->decide(decision);
  }
  int num_steps() const { return recorded().num_frames - 1; }
  const ReplayMetrics& metrics() const { return recorded().metrics; }

  void write(const std::string& path, const std::string& policy) {
    const bool is_html = path.ends_with(".html"), is_mcap = path.ends_with(".mcap");
    if (!is_html && !is_mcap) fail_usage("write: expected a file *.html or *.mcap, got '{}'", path);
    if (recorder_) {
      ReplayOrigin origin = origin_of(policy);
      inside_.run("write", [&] { finished_ = recorder_->finish(std::move(origin)); });
      recorder_.reset();
    }
    const GilRelease no_gil;
    is_html ? write_replay(path, *finished_) : write_mcap(path, *finished_);
  }

 private:
  const Replay& recorded() const { return recorder_ ? recorder_->recorded() : *finished_; }

  SimulatorInside inside_;
  const int followed_;
  std::optional<Recorder> recorder_;
  std::optional<Replay> finished_;
};

class PyLiveView final : public StepObserver {
 public:
  PyLiveView(SimulatorInside inside, const LiveViewOptions& options) : inside_(std::move(inside)) {
    const ReplayOrigin origin = origin_of("");
    inside_.run("LiveView", [&] {
      view_ = std::make_unique<LiveView>(*inside_.simulator, options, origin,
                                         [this](int agent) { return agent == decided_ ? decision_ : std::nullopt; });
    });
  }

  bool is_due() override { return !view_ || view_->is_due(); }
  void override_commands(Span<Command> commands_inout) override {
    if (view_) view_->override_commands(commands_inout);
  }
  void before_step(Span<const Command> commands) override {
    if (view_) view_->before_step(commands);
  }
  void after_step(const StepResult& result) override {
    if (view_) view_->after_step(result);
  }
  void after_reset(Span<const uint8_t> world_mask) override {
    if (view_) view_->after_reset(world_mask);
  }

  void decide(int agent, const ReplayDecision& decision) {
    decided_ = agent;
    decision_ = decision;
  }
  std::string address() const { return open().address(); }
  int num_pages() const { return open().num_pages(); }
  void close() {
    if (!view_) return;
    inside_.run("close", [this] {
      view_->finish();
      view_.reset();
    });
  }

 private:
  LiveView& open() const {
    PICTURA_CHECK(view_, "LiveView: is closed");
    return *view_;
  }

  SimulatorInside inside_;
  std::unique_ptr<LiveView> view_;
  int decided_ = -1;
  std::optional<ReplayDecision> decision_;
};

py::dict dict_of(const ReplayMetrics& metrics) {
  py::dict d;
#define X(name) d[#name] = metrics.name;
  PICTURA_REPLAY_METRICS(X)
#undef X
  return d;
}

}  // namespace

void bind_replays(py::module_& module) {
  py::class_<PyRecorder, std::shared_ptr<PyRecorder>>(module, "Recorder", R"(
Records one world as a replay. The simulator must be on the CPU. While the recorder exists, it records every step of the
simulator, by any function.

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
    >>> recorder = pictura.Recorder(simulator, follow=0)
    >>> simulator.run(pictura.Controller('lane', simulator), 50)
    >>> recorder.write('drive.html')
    >>> recorder.num_steps
    50)")
      .def(py::init([](const py::object& simulator, int world, int follow, const std::optional<Rig>& rig) {
             SimulatorInside inside = inside_of<SimulatorInside>(simulator, "Recorder", "Simulator");
             const auto watch = inside.watch;
             auto recorder = std::make_shared<PyRecorder>(
                 std::move(inside),
                 RecorderOptions{
                     .world = world, .followed = follow, .cameras = cameras_of(rig), .keeps_images = rig.has_value()});
             watch(recorder);
             return recorder;
           }),
           py::arg("simulator"), py::kw_only(), py::arg("world") = 0, py::arg("follow") = -1,
           py::arg("rig") = py::none(), py::keep_alive<1, 2>(),
           R"(follow: agent that the page shows first, and whose decisions are recorded; -1: none.
rig: cameras whose images of this agent are recorded at every step, losslessly, with the CPU renderer. By default no
images are recorded, and the page draws images of the paper's cameras.
Raises pictura.UsageError if the world or agent does not exist or the simulator is on CUDA.)")
      .def(
          "decide",
          [](PyRecorder& self, const py::array_t<float, py::array::c_style | py::array::forcecast>& logits,
             float value) { self.decide(decision_of_python(logits, value)); },
          py::arg("logits"), py::arg("value") = 0.0f,
          "Records a policy's logits [12] and value for the followed agent, which belong to the next step.")
      .def_property_readonly("num_steps", &PyRecorder::num_steps, "Number of recorded steps and resets.")
      .def_property_readonly(
          "metrics", [](const PyRecorder& self) { return dict_of(self.metrics()); }, "Dict of counts and sums so far.")
      .def(
          "write", &PyRecorder::write, py::arg("path"), py::arg("policy") = "",
          R"(Ends the recording and writes it to a file, completely or not at all: *.html, a page for any browser, or *.mcap, for
Foxglove. May be called repeatedly. policy: name of the policy, which the page shows. Raises pictura.Error if the file
cannot be written.)");

  py::class_<PyLiveView, std::shared_ptr<PyLiveView>>(module, "LiveView", R"(
Live page in the browser, which shows the only world of a simulator while it runs. The simulator must be on the CPU. The
page can pause the simulator, take single steps, change the speed, and drive an agent with the keyboard. Steps of the
simulator wait, so that they run in real time or at the speed that the page sets.

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
    >>> view = pictura.LiveView(simulator, wait_for_page=False)
    >>> view.address.startswith('http://')
    True
    >>> simulator.run(pictura.Controller('lane', simulator), 3)
    >>> view.close())")
      .def(py::init([](const py::object& simulator, int port, const std::string& host_name, int follow,
                       const std::optional<Rig>& rig, bool wait_for_page) {
             SimulatorInside inside = inside_of<SimulatorInside>(simulator, "LiveView", "Simulator");
             const auto watch = inside.watch;
             auto view =
                 std::make_shared<PyLiveView>(std::move(inside), LiveViewOptions{.port = port,
                                                                                 .host_name = host_name,
                                                                                 .watched = follow,
                                                                                 .cameras = cameras_of(rig),
                                                                                 .sends_images = rig.has_value(),
                                                                                 .waits_for_page = wait_for_page});
             watch(view);
             return view;
           }),
           py::arg("simulator"), py::kw_only(), py::arg("port") = 0, py::arg("host_name") = "", py::arg("follow") = 0,
           py::arg("rig") = py::none(), py::arg("wait_for_page") = true, py::keep_alive<1, 2>(),
           R"(port: port on the loopback interface; 0: a free port.
host_name: if given, the server listens on all interfaces, and browsers reach this machine by this name.
follow: agent that pages show first.
rig: cameras of this agent's images; by default pages draw images of the paper's cameras.
wait_for_page: whether the first step waits for the first page.
Raises pictura.UsageError if this package has no server, and pictura.Error if the port is in use.)")
      .def(
          "decide",
          [](PyLiveView& self, int agent, const py::array_t<float, py::array::c_style | py::array::forcecast>& logits,
             float value) { self.decide(agent, decision_of_python(logits, value)); },
          py::arg("agent"), py::arg("logits"), py::arg("value") = 0.0f,
          "Sets a policy's logits [12] and value for an agent. Pages that follow this agent show them until the next "
          "call.")
      .def_property_readonly("address", &PyLiveView::address, "URL of the page, including a secret token.")
      .def_property_readonly("num_pages", &PyLiveView::num_pages, "Number of connected pages.")
      .def("close", &PyLiveView::close,
           "Notifies pages that the simulation has ended. The simulator's steps no longer wait.");

  module.def(
      "write_gallery",
      [](const std::string& folder) {
        const GilRelease no_gil;
        return write_gallery(folder);
      },
      py::arg("folder"),
      R"(Writes FOLDER/index.html, an index of the replays in the folder, sorted from the worst. Returns the number of replays.
Raises pictura.Error, which names a page that is not a replay.

Examples:
    >>> pictura.write_gallery('replays')            # doctest: +SKIP
    4)");
}

}  // namespace pictura::python
