// C++ objects behind Python classes, for several files and extension modules.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/bindings/arrays.h"
#include "pictura/bindings/call.h"
#include "pictura/common/renderer.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura::python {

/// Road map (pictura.Map) with its compiled versions.
class Map {
 public:
  /// source: name in messages.
  Map(std::shared_ptr<const RoadMap> road, std::string source) : road_(std::move(road)), source_(std::move(source)) {}
  virtual ~Map() = default;
  const std::shared_ptr<const RoadMap>& road() const { return road_; }
  const std::string& source() const { return source_; }
  /// Compiles once for each set of options. The caller must hold the GIL.
  std::shared_ptr<const CompiledMap> compiled(const MapOptions& options);

 protected:
  /// Returns a function that compiles the map and owns all data that it reads.
  virtual std::function<std::shared_ptr<const CompiledMap>()> compilation(const MapOptions& options) const;

 private:
  std::shared_ptr<const RoadMap> road_;
  std::string source_;
  std::vector<std::shared_ptr<const CompiledMap>> compiled_;
};

/// Recorded scene from a start step on, as a map whose agents are the scene's tracks.
class RecordedScene final : public Map {
 public:
  /// Throws UsageError for a step that the scene lacks.
  RecordedScene(std::shared_ptr<const Scenario> scenario, std::string source, int32_t start_step,
                bool recorded_lights = false);
  const std::shared_ptr<const Scenario>& scenario() const { return scenario_; }
  int32_t start_step() const { return start_step_; }
  bool recorded_lights() const { return recorded_lights_; }

 private:
  std::function<std::shared_ptr<const CompiledMap>()> compilation(const MapOptions& options) const override;

  std::shared_ptr<const Scenario> scenario_;
  int32_t start_step_;
  bool recorded_lights_;
};

struct Geometry {
  std::shared_ptr<const StaticGeometry> geometry;
};

/// Moving objects: a caller's arrays, or a simulator's current scene.
struct Scene {
  std::shared_ptr<const void> owner;
  std::function<SceneBatch()> batch;
  Stream stream;
};

/// Contents of a pictura.Simulator.
struct SimulatorInside {
  std::shared_ptr<Simulator> simulator;
  /// Runs `work` as Calls::run() does.
  std::function<void(std::string_view what, const std::function<void()>& work)> run;
  /// Adds an observer until its destruction.
  std::function<void(const std::shared_ptr<StepObserver>&)> watch;
};

struct RendererInside {
  std::shared_ptr<Renderer> renderer;
  std::shared_ptr<SingleCallGuard> call_guard;
};

struct ControllerInside {
  std::shared_ptr<Simulator> of;
  std::shared_ptr<Controller> controller;
};

/// Returns the contents of a Python object. Throws UsageError, beginning with `what`, unless the object's contents are
/// Inside; `expected` names the class in the message, such as "Simulator".
template <typename Inside>
Inside inside_of(const py::handle& object, std::string_view what, std::string_view expected) {
  const py::object inside = py::hasattr(object, "_inside") ? py::object(object.attr("_inside")()) : py::none();
  if (!py::isinstance<Inside>(inside)) {
    fail_usage("{}: expected a pictura.{}, got {}", what, expected, type_name_of(object));
  }
  return py::cast<Inside>(inside);
}

/// Throws Error with the reason `choice` if a device was wanted but the CPU was chosen.
void check_device(std::string_view what, Device wanted, Device given, std::string_view choice);

/// Converts an int, or None for CUDA's legacy default stream. Throws UsageError for other values.
Stream stream_of(const py::object& handle);

py::dict facts_of(const MapFacts& facts);

/// Returns a map from above, [height, width, 3]. With a scenario, also draws its tracks and, unless `step` is -1, their
/// boxes. The caller must hold the GIL.
py::array_t<uint8_t> draw(const RoadMap& map, int width_px, int height_px, const Scenario* scenario = nullptr,
                          int step = -1);

void bind_maps(py::module_& module);
void bind_scenarios(py::module_& module);
void bind_rendering(py::module_& module);
void bind_simulator(py::module_& module);
void bind_replays(py::module_& module);
void bind_realism(py::module_& module);

}  // namespace pictura::python
