// The scenes of many steps as one scene. One call redraws the images of any agents at any of these steps: minibatches,
// films and replays read the history instead of stored images.
#pragma once

#include <memory>

#include "pictura/common/array.h"
#include "pictura/common/error_types.h"
#include "pictura/common/history_views.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Capacity of a history; every step has the same number of each item.
struct SceneHistorySize {
  int num_steps = 0;
  std::size_t worlds = 0, agents = 0, lights = 0, views = 0;  // per step
};

/// History of scenes in the memory of one device. World w of step s is world s * worlds + w of the history, and so on
/// for agents and lights. The rules of Renderer for devices, streams and waiting apply: put() and gather() neither
/// allocate nor wait.
class SceneHistory {
 public:
  /// Throws Error if the history has more agents or lights than a scene can have.
  explicit SceneHistory(const SceneHistorySize& size);
  virtual ~SceneHistory() = default;
  SceneHistory(const SceneHistory&) = delete;
  SceneHistory& operator=(const SceneHistory&) = delete;

  virtual Device device() const = 0;
  const SceneHistorySize& size() const { return size_; }

  /// Stores a scene and the views of its agents at `step`, replacing the step's previous content. Steps must be filled
  /// in order first. Throws Error if the scene is of another device or size, hides agents, or a step is left out.
  void put(int step, const SceneBatch& scene, Span<const View> views, Stream stream = {});

  /// Returns the scene of all steps that have been put.
  virtual SceneBatch scene() const = 0;

  /// Copies views in scene(), by rows step * size().views + view. A row of a step that has not been put, or of a view
  /// that renderers would refuse in its own step, gives a view that renderers refuse. Throws Error unless there are as
  /// many rows as views_out.
  void gather(Span<const int64_t> rows, Span<View> views_out, Stream stream = {}) const;

 protected:
  /// Number of steps that have been put.
  int num_steps() const { return num_steps_; }
  /// Row mapping of gather(), for views in the order of put().
  HistoryViews history_views(const View* views) const {
    return {views, static_cast<int64_t>(size_.views), num_steps_, static_cast<int32_t>(size_.worlds),
            static_cast<int32_t>(size_.agents)};
  }

 private:
  virtual void copy_step(int step, const SceneBatch& scene, Span<const View> views, Stream stream) = 0;
  virtual void copy_views(Span<const int64_t> rows, Span<View> views_out, Stream stream) const = 0;

  SceneHistorySize size_;
  int num_steps_ = 0;
};

/// Memory of a history, for both devices: Buffer<T>(n) holds n elements at data().
template <template <typename...> class Buffer>
struct SceneHistoryArrays {
  SceneHistorySize size;
  Buffer<AgentBox> agents;
  Buffer<GeometryHandle> geometry;
  Buffer<LightState> light_states;
  Buffer<int32_t> world_begin, light_begin;
  Buffer<View> views;

  explicit SceneHistoryArrays(const SceneHistorySize& s)
      : size(s),
        agents(count(s.num_steps, s.agents)),
        geometry(count(s.num_steps, s.worlds)),
        light_states(count(s.num_steps, s.lights)),
        world_begin(count(s.num_steps, s.worlds) + 1),
        light_begin(count(s.num_steps, s.worlds) + 1),
        views(count(s.num_steps, s.views)) {}

  /// Returns the scene of the first num_steps steps.
  SceneBatch scene(Device device, int num_steps) const {
    const std::size_t worlds = count(num_steps, size.worlds);
    return {device,
            {world_begin.data(), worlds + 1},
            {agents.data(), count(num_steps, size.agents)},
            {geometry.data(), worlds},
            {light_begin.data(), worlds + 1},
            {light_states.data(), count(num_steps, size.lights)},
            {}};
  }

  /// Writes a step: copy(from, first) copies elements, and shift(from, added, first) adds a number to each element.
  template <typename Copy, typename Shift>
  void write_step(int step, const SceneBatch& scene, Span<const View> step_views, Copy&& copy, Shift&& shift) {
    const std::size_t worlds = count(step, size.worlds);
    copy(scene.agents, agents.data() + count(step, size.agents));
    copy(scene.geometry, geometry.data() + worlds);
    copy(scene.light_states, light_states.data() + count(step, size.lights));
    copy(step_views, views.data() + count(step, size.views));
    shift(scene.world_begin, static_cast<int32_t>(count(step, size.agents)), world_begin.data() + worlds);
    shift(scene.light_begin, static_cast<int32_t>(count(step, size.lights)), light_begin.data() + worlds);
  }

 private:
  static std::size_t count(int steps, std::size_t of_step) { return static_cast<std::size_t>(steps) * of_step; }
};

/// Makes a history in host memory.
std::unique_ptr<SceneHistory> make_host_scene_history(const SceneHistorySize& size);

/// Size of a history in bytes.
int64_t bytes_of(const SceneHistorySize& size);

}  // namespace pictura
