// C++ objects behind Python classes (maps, geometries and scenes), for several files of the bindings. Also the contents
// of simulators, renderers and controllers, which the extension modules pass to each other.
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
  /// Wraps a map. Messages contain `source`, the name of its file.
  Map(std::shared_ptr<const RoadMap> road, std::string source) : road_(std::move(road)), source_(std::move(source)) {}
  virtual ~Map() = default;
  const std::shared_ptr<const RoadMap>& road() const { return road_; }
  const std::string& source() const { return source_; }
  /// Returns the map compiled with these options. The first call for each set of options compiles it. The caller must
  /// hold the GIL.
  std::shared_ptr<const CompiledMap> compiled(const MapOptions& options);

 protected:
  /// Returns a function that compiles the map. The function owns all data that it reads.
  virtual std::function<std::shared_ptr<const CompiledMap>()> compilation(const MapOptions& options) const;

 private:
  std::shared_ptr<const RoadMap> road_;
  std::string source_;
  std::vector<std::shared_ptr<const CompiledMap>> compiled_;
};

/// Recorded scene from a start step on, as a map. The agents of worlds on this map are the scene's tracks.
class RecordedScene final : public Map {
 public:
  /// Throws UsageError for a step that the scene does not have.
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

/// Geometry of a map for renderers.
struct Geometry {
  std::shared_ptr<const StaticGeometry> geometry;
};

/// Moving objects to draw: arrays of a caller, or the current scene of a simulator.
struct Scene {
  std::shared_ptr<const void> owner;
  std::function<SceneBatch()> batch;
  Stream stream;
};

/// C++ contents of a pictura.Simulator.
struct SimulatorInside {
  std::shared_ptr<Simulator> simulator;
  /// Runs `work` without the GIL, as one call of the simulator (see Calls::run()).
  std::function<void(std::string_view what, const std::function<void()>& work)> run;
  /// Adds an observer of steps. It is removed when the observer is destroyed.
  std::function<void(const std::shared_ptr<StepObserver>&)> watch;
};

/// C++ contents of a pictura.Renderer.
struct RendererInside {
  std::shared_ptr<Renderer> renderer;
  std::shared_ptr<SingleCallGuard> call_guard;
};

/// C++ contents of a pictura.Controller.
struct ControllerInside {
  std::shared_ptr<Simulator> of;
  std::shared_ptr<Controller> controller;
};

/// Returns the C++ contents of a Python object. Throws UsageError if it is not a pictura.EXPECTED, where EXPECTED is
/// the value of `expected`, such as "Simulator". The message begins with `what`.
template <typename Inside>
Inside inside_of(const py::handle& object, std::string_view what, std::string_view expected) {
  const py::object inside = py::hasattr(object, "_inside") ? py::object(object.attr("_inside")()) : py::none();
  if (!py::isinstance<Inside>(inside)) {
    fail_usage("{}: expected a pictura.{}, got {}", what, expected, type_name_of(object));
  }
  return py::cast<Inside>(inside);
}

/// Throws Error if a device was requested but the CPU was chosen. The message contains `choice`, the reason.
void check_device(std::string_view what, Device wanted, Device given, std::string_view choice);

/// Converts a stream handle of Python: an int, or None for CUDA's legacy default stream. Throws UsageError for other
/// values.
Stream stream_of(const py::object& handle);

/// Converts facts of a map to a dict.
py::dict facts_of(const MapFacts& facts);

/// Draws a map from above and returns the image, uint8 [height, width, 3]. For a scenario on this map, also draws its
/// tracks and, unless `step` is -1, their boxes at that step. The caller must hold the GIL.
py::array_t<uint8_t> draw(const RoadMap& map, int width_px, int height_px, const Scenario* scenario = nullptr,
                          int step = -1);

void bind_maps(py::module_& module);
void bind_scenarios(py::module_& module);
void bind_rendering(py::module_& module);
void bind_simulator(py::module_& module);
void bind_replays(py::module_& module);
void bind_realism(py::module_& module);

}  // namespace pictura::python
