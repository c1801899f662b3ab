// Realism scores of simulated traffic, which pictura/realism.py wraps.
#include "pictura/evaluation/realism.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/common/support/json_text.h"

namespace pictura::python {

namespace {

using Ids = py::array_t<int64_t, py::array::c_style | py::array::forcecast>;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

SceneRollouts rollouts_of(const Ids& track_ids, const Doubles& center_m, const Doubles& heading_rad) {
  if (track_ids.ndim() != 1) fail_usage("track_ids: expected [tracks], got {} dimensions", track_ids.ndim());
  const py::ssize_t tracks = track_ids.shape(0);
  if (center_m.ndim() != 4 || center_m.shape(1) != tracks || center_m.shape(3) != 3) {
    fail_usage("center_m: expected [rollouts, {} tracks, steps, 3]", tracks);
  }
  if (heading_rad.ndim() != 3 || !std::equal(heading_rad.shape(), heading_rad.shape() + 3, center_m.shape())) {
    fail_usage("heading_rad: expected [{}, {}, {}], as of center_m", center_m.shape(0), tracks, center_m.shape(2));
  }
  SceneRollouts scene;
  scene.steps = static_cast<int>(center_m.shape(2));
  scene.track_ids.assign(track_ids.data(), track_ids.data() + tracks);
  const double *xyz = center_m.data(), *heading = heading_rad.data();
  const auto each = static_cast<size_t>(tracks) * static_cast<size_t>(scene.steps);
  for (py::ssize_t rollout = 0; rollout < center_m.shape(0); ++rollout) {
    std::vector<SimulatedState>& states = scene.rollouts.emplace_back();
    for (size_t i = 0; i < each; ++i, xyz += 3) {
      states.push_back({static_cast<float>(xyz[0]), static_cast<float>(xyz[1]), static_cast<float>(xyz[2]),
                        static_cast<float>(*heading++)});
    }
  }
  return scene;
}

/// Returns the features of rollouts as a dict of arrays [rollouts, road users, steps].
py::dict arrays_of(const std::vector<RealismFeatures>& rollouts) {
  const size_t objects = rollouts.empty() ? 0 : rollouts[0].num_objects();
  const size_t steps = rollouts.empty() ? 0 : rollouts[0].num_steps();
  py::dict arrays;
  for (size_t f = 0; f < kNumRealismFeatures; ++f) {
    const auto feature = static_cast<RealismFeature>(f);
    py::array_t<double> array({rollouts.size(), objects, steps});
    double* out = array.mutable_data();
    for (const RealismFeatures& one : rollouts) {
      for (size_t i = 0; i < objects; ++i) {
        const Span<const double> values = one.of(i, feature);
        out = std::copy(values.begin(), values.end(), out);
      }
    }
    arrays[to_string(feature)] = array;
  }
  return arrays;
}

std::string score_of(const RecordedScene& scene, const Ids& track_ids, const Doubles& center_m,
                     const Doubles& heading_rad, const std::string& version) {
  const SceneRollouts rollouts = rollouts_of(track_ids, center_m, heading_rad);
  return run_interruptibly("realism.score", 1, {}, [scenario = scene.scenario(), rollouts, version] {
    RealismReport report;
    report.version = version;
    report.scenes.push_back(RealismScene(scenario).score(rollouts, realism_version(version)));
    return json_text(realism_json(report)["scenes"][0]);
  });
}

py::tuple features_of(const RecordedScene& scene, const Ids& track_ids, const Doubles& center_m,
                      const Doubles& heading_rad) {
  const SceneRollouts rollouts = rollouts_of(track_ids, center_m, heading_rad);
  const auto [ids, recorded, simulated] =
      run_interruptibly("realism.features", 1, {}, [scenario = scene.scenario(), rollouts] {
        const RealismScene realism(scenario);
        std::vector<RealismFeatures> all;
        for (size_t i = 0; i < rollouts.rollouts.size(); ++i) all.push_back(realism.features(rollouts, i));
        return std::tuple(realism.scored_ids(), std::vector{realism.recorded_features()}, all);
      });
  return py::make_tuple(py::array_t<int64_t>(static_cast<py::ssize_t>(ids.size()), ids.data()), arrays_of(recorded),
                        arrays_of(simulated));
}

py::dict rollouts_in(const std::string& path) {
  const auto scenes = run_interruptibly("realism.read_rollouts", 1, {}, [path] {
    const RolloutsReader reader(path);
    std::vector<SceneRollouts> all;
    for (const std::string& id : reader.scenario_ids()) all.push_back(reader.read(id));
    return all;
  });
  py::dict by_id;
  for (const SceneRollouts& scene : scenes) {
    const size_t rollouts = scene.rollouts.size(), tracks = scene.track_ids.size();
    const auto steps = static_cast<size_t>(scene.steps);
    py::array_t<float> center({rollouts, tracks, steps, size_t{3}}), heading({rollouts, tracks, steps});
    float *xyz = center.mutable_data(), *angle = heading.mutable_data();
    for (const std::vector<SimulatedState>& rollout : scene.rollouts) {
      for (const SimulatedState& state : rollout) {
        for (const float value : {state.x_m, state.y_m, state.z_m}) *xyz++ = value;
        *angle++ = state.heading_rad;
      }
    }
    by_id[py::str(scene.scenario_id)] =
        py::make_tuple(py::array_t<int64_t>(static_cast<py::ssize_t>(tracks), scene.track_ids.data()), center, heading);
  }
  return by_id;
}

}  // namespace

void bind_realism(py::module_& module) {
  module.attr("REALISM_VERSIONS") = py::tuple(py::cast(realism_version_names()));
  module.def("_realism_score", score_of, py::arg("scene"), py::arg("track_ids"), py::arg("center_m"),
             py::arg("heading_rad"), py::arg("version"), "See pictura.realism.score(): its result as JSON.");
  module.def("_realism_features", features_of, py::arg("scene"), py::arg("track_ids"), py::arg("center_m"),
             py::arg("heading_rad"), "See pictura.realism.features().");
  module.def("_read_rollouts", rollouts_in, py::arg("path"), "See pictura.realism.read_rollouts().");
  module.def(
      "_score_rollouts",
      [](const std::string& path, const std::vector<std::string>& scenes, const std::string& version, int num_threads) {
        return run_interruptibly("realism.score_file", num_threads, {}, [=] {
          return json_text(realism_json(score_rollouts(path, scenes, realism_version(version), num_threads)));
        });
      },
      py::arg("path"), py::arg("scenes"), py::arg("version"), py::arg("num_threads"),
      "See pictura.realism.score_file(): its result as JSON.");
}

}  // namespace pictura::python
