// Storage of the scenes of many steps as one large scene, from which images of any step can be drawn again.
#pragma once

#include <memory>

#include "pictura/common/array.h"
#include "pictura/common/error_types.h"
#include "pictura/common/history_views.h"
#include "pictura/common/scene.h"

namespace pictura {

/// Capacity of a history. All steps have the same sizes.
struct SceneHistorySize {
  int num_steps = 0;
  std::size_t worlds = 0, agents = 0, lights = 0, views = 0;  // per step
};

/// History of scenes in the memory of one device. World w of step s is world s * worlds + w of the history. Agents and
/// lights are numbered in the same way. put() and gather() neither allocate nor wait. The rules of Renderer
/// (renderer.h) for devices and streams apply.
class SceneHistory {
 public:
  /// Throws Error if num_steps is less than 1, or if the history has more worlds, agents or lights than int32_t can
  /// count.
  explicit SceneHistory(const SceneHistorySize& size);
  virtual ~SceneHistory() = default;
  SceneHistory(const SceneHistory&) = delete;
  SceneHistory& operator=(const SceneHistory&) = delete;

  virtual Device device() const = 0;
  const SceneHistorySize& size() const { return size_; }

  /// Stores a scene and views of its agents, replacing the step's content. Throws Error if the scene is on another
  /// device, has other sizes or has hidden agents, or if an earlier step is missing.
  void put(int step, const SceneBatch& scene, Span<const View> views, Stream stream = {});

  /// Returns the scene of all stored steps.
  virtual SceneBatch scene() const = 0;

  /// Copies stored views, with their worlds and agents renumbered for scene(). Row step * size().views + view selects a
  /// view of a step. Renderers refuse copies of missing or invalid views. Throws Error unless rows and views_out have
  /// equal lengths.
  void gather(Span<const int64_t> rows, Span<View> views_out, Stream stream = {}) const;

 protected:
  int num_steps() const { return num_steps_; }
  /// Returns the stored views, for gather(). `views`: [steps, views per step].
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

/// Memory of a history. Buffer<T>(n) is a buffer of n elements that begins at data().
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

  /// Writes a step. copy(from, to) copies elements. shift(from, added, to) also adds `added` to each element.
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

std::unique_ptr<SceneHistory> make_host_scene_history(const SceneHistorySize& size);

int64_t bytes_of(const SceneHistorySize& size);

}  // namespace pictura
