// Extension module pictura._training_MAJOR_MINOR: training, and all functions of pictura._driving, for one version of
// torch.
#include <array>
#include <string>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "pictura/bindings/call.h"
#include "pictura/bindings/driving.h"
#include "pictura/bindings/options.h"
#include "pictura/commit.h"
#include "pictura/training/loop.h"

namespace pictura::python {

namespace {

py::dict dict_of(const TrainProgress& progress) {
  py::dict scalars;
  for (const auto& [name, value] : progress.scalars) scalars[py::str(std::string(name))] = value;
  py::dict d;
  d["update"] = progress.update;
  d["updates"] = progress.updates;
  d["agent_steps"] = progress.agent_steps;
  d["agent_steps_per_s"] = progress.agent_steps_per_s;
  d["episode_return"] = progress.episode_return;
  d["eta_s"] = progress.eta_s;
  d["scalars"] = scalars;
  return d;
}

py::dict dict_of(const TrainReport& report) {
  py::dict d;
  d["agent_steps"] = report.agent_steps;
  d["updates"] = report.updates;
  d["agent_steps_per_s"] = report.agent_steps_per_s;
  d["episode_return"] = report.episode_return;
  d["km_driven"] = report.km_driven;
  d["ranks"] = report.ranks;
  d["evaluation_s"] = report.evaluation_s;
  d["out_of_time"] = report.out_of_time;
  d["checkpoint"] = report.checkpoint;
  d["policy_hash"] = report.policy_hash;
  d["device"] = report.device;
  d["simulator"] = report.simulator;
  d["renderer"] = report.renderer;
  return d;
}

struct TrainArguments {
  TrainOptions options;
  py::object on_progress = py::none();
};

template <typename Visitor>
void visit_options(TrainArguments& arguments, Visitor&& v) {
  static constexpr std::array<const char*, 3> kOldRunNames{"refuse", "resume", "overwrite"};
  TrainOptions& options = arguments.options;
  v.value({"config"}, options.config_path);
  v.value({"out"}, options.out_folder);
  v.value({"overrides"}, options.overrides);
  v.choice({"old_run"}, options.old_run, kOldRunNames);
  v.value({"init_from"}, options.init_from);
  v.value({"minutes"}, options.minutes);
  v.value({"on_progress"}, arguments.on_progress);
  v.callback({"on_notice"}, options.on_notice);
}

py::dict train_from_python(TrainArguments& arguments) {
  TrainOptions& options = arguments.options;
  options.commit = PICTURA_COMMIT;
  options.launch = launch_from_environment();
  if (!arguments.on_progress.is_none()) {
    options.on_progress = [&arguments](const TrainProgress& progress) {
      const py::gil_scoped_acquire gil;
      arguments.on_progress(dict_of(progress));
    };
  }
  return dict_of(run_interruptible("train", 0, {}, [&options] { return train(options); }));
}

void bind_train(py::module_& module) {
  def_with_options<TrainArguments>(
      &module, {"train", {"config", "out"}}, &train_from_python,
      R"(Trains a policy by self-play, like `pictura train`, and writes the same files into the folder `out`.

Returns a dict: agent_steps, updates, agent_steps_per_s, episode_return, km_driven, checkpoint, policy_hash and more. ^C
ends training after the current update, saves a checkpoint, and raises KeyboardInterrupt.

Args:
    config: A TOML file (docs/reference/configuration.md).
    out: Folder for the run's files.
    overrides: Values that replace those in the file, such as 'train.updates=2'.
    old_run: What happens to an existing run in `out`: 'refuse', 'resume' or 'overwrite'.
    init_from: A checkpoint whose weights are the initial weights.
    minutes: Limit of the duration in minutes; 0: none.
    on_progress: Function that is called after every update with a dict: update, updates, agent_steps,
        agent_steps_per_s, episode_return, eta_s, and scalars (the columns of progress.csv).
    on_notice: Function that is called with the text of a notice. Both functions are called from the training's own
        thread; their exceptions end the training.

Raises:
    pictura.Error: An input is invalid; the message names file and key.

Examples:
    >>> report = pictura.train('configs/smoke.toml', 'runs/mine', old_run='overwrite')
    >>> report['updates']
    4)");
}

}  // namespace

}  // namespace pictura::python

PYBIND11_MODULE(PICTURA_TRAINING_MODULE, module) {
  module.doc() = "Training, evaluation and saved policies, with torch. Import these names from `pictura`.";
  pictura::python::bind_driving(module);
  pictura::python::bind_train(module);
}
