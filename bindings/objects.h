// What the parts of the bindings exchange: maps, geometries, scenes, renderers' images and simulators as Python holds
// them, and what the extension with torch, a library of its own, takes from and gives to the one without.
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

/// A road map, and what has been compiled of it.
class Map {
 public:
  /// `source` names its file in messages.
  Map(std::shared_ptr<const RoadMap> road, std::string source) : road_(std::move(road)), source_(std::move(source)) {}
  virtual ~Map() = default;
  const std::shared_ptr<const RoadMap>& road() const { return road_; }
  const std::string& source() const { return source_; }
  /// Compiles at the first call with these options. The caller holds the GIL.
  std::shared_ptr<const CompiledMap> compiled(const MapOptions& options);

 protected:
  /// Compiles it; owns all that it reads.
  virtual std::function<std::shared_ptr<const CompiledMap>()> compilation(const MapOptions& options) const;

 private:
  std::shared_ptr<const RoadMap> road_;
  std::string source_;
  std::vector<std::shared_ptr<const CompiledMap>> compiled_;
};

/// A recorded scene from one of its steps on: the map of worlds whose agents are its tracks.
class RecordedScene final : public Map {
 public:
  /// Throws UsageError for a step that it does not have.
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

/// What a renderer draws of a map.
struct Geometry {
  std::shared_ptr<const StaticGeometry> geometry;
};

/// What moves: arrays of a caller, or what a simulator shows, as it is at each call.
struct Scene {
  std::shared_ptr<const void> owner;
  std::function<SceneBatch()> batch;
  Stream stream;
};

/// What is inside a pictura.Simulator.
struct SimulatorInside {
  std::shared_ptr<Simulator> simulator;
  /// Runs work without the GIL while no other thread is in a call of the simulator.
  std::function<void(std::string_view what, const std::function<void()>& work)> run;
  /// Lets a watcher see steps for as long as it lives.
  std::function<void(const std::shared_ptr<StepObserver>&)> watch;
};

/// What is inside a pictura.Renderer.
struct RendererInside {
  std::shared_ptr<Renderer> renderer;
  std::shared_ptr<Turnstile> turnstile;
};

/// What becomes a pictura.Controller.
struct ControllerInside {
  std::shared_ptr<Simulator> of;
  std::shared_ptr<Controller> controller;
};

/// What is inside a pictura.Simulator or a pictura.Renderer, as `expected` names it. Throws UsageError for other
/// objects; `what` begins its message.
template <typename Inside>
Inside inside_of(const py::handle& object, std::string_view what, std::string_view expected) {
  const py::object inside = py::hasattr(object, "_inside") ? py::object(object.attr("_inside")()) : py::none();
  if (!py::isinstance<Inside>(inside)) {
    fail_usage("{}: expected a pictura.{}, got {}", what, expected, type_name_of(object));
  }
  return py::cast<Inside>(inside);
}

/// Throws Error where a device was asked for and the CPU chosen; `choice` says why.
void check_device(std::string_view what, Device wanted, Device given, std::string_view choice);

/// Of a stream's handle as Python has it, an int; None: CUDA's legacy default stream. Throws UsageError for others.
Stream stream_of(const py::object& handle);

/// Of a map, by name.
py::dict facts_of(const MapFacts& facts);

/// From above, uint8 [height, width, 3]; of a scenario on that map its tracks as well, and their boxes at a step. The
/// caller holds the GIL.
py::array_t<uint8_t> draw(const RoadMap& map, int width_px, int height_px, const Scenario* scenario = nullptr,
                          int step = -1);

void bind_maps(py::module_& module);
void bind_scenarios(py::module_& module);
void bind_rendering(py::module_& module);
void bind_simulator(py::module_& module);
void bind_replays(py::module_& module);

}  // namespace pictura::python
