#include "pictura/common/scene_history.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "pictura/common/error.h"

namespace pictura {

SceneHistory::SceneHistory(const SceneHistorySize& size) : size_(size) {
  const auto check = [&size](const char* what, std::size_t of_step) {
    const double total = static_cast<double>(of_step) * size.num_steps;
    PICTURA_CHECK(total <= std::numeric_limits<int32_t>::max(), "scene history: expected at most {} {}, got {:.0f}",
                  std::numeric_limits<int32_t>::max(), what, total);
  };
  PICTURA_CHECK(size.num_steps >= 1, "scene history: expected one step or more, got {}", size.num_steps);
  check("agents", size.agents);
  check("worlds", size.worlds);
  check("lights", size.lights);
}

void SceneHistory::put(int step, const SceneBatch& scene, Span<const View> views, Stream stream) {
  PICTURA_CHECK(step >= 0 && step < size_.num_steps && step <= num_steps_,
                "scene history: expected a step of 0 to {}, got {}", std::min(num_steps_, size_.num_steps - 1), step);
  PICTURA_CHECK(scene.device == device(), "scene history: expected a scene on {}, got a scene on {}", name_of(device()),
                name_of(scene.device));
  const auto check = [](const char* what, std::size_t expected, std::size_t got) {
    PICTURA_CHECK(got == expected, "scene history: {}: expected {} per step, got {}", what, expected, got);
  };
  check("worlds", size_.worlds, scene.geometry.size());
  check("world_begin", size_.worlds + 1, scene.world_begin.size());
  check("light_begin", size_.worlds + 1, scene.light_begin.size());
  check("agents", size_.agents, scene.agents.size());
  check("lights", size_.lights, scene.light_states.size());
  check("views", size_.views, views.size());
  check("hidden agents", 0, scene.hidden_agents.size());
  copy_step(step, scene, views, stream);
  num_steps_ = std::max(num_steps_, step + 1);
}

void SceneHistory::gather(Span<const int64_t> rows, Span<View> views_out, Stream stream) const {
  PICTURA_CHECK(rows.size() == views_out.size(), "scene history: expected memory for {} views, got {}", rows.size(),
                views_out.size());
  if (!rows.empty()) copy_views(rows, views_out, stream);
}

int64_t bytes_of(const SceneHistorySize& size) {
  const std::size_t step = size.agents * sizeof(AgentBox) + size.views * sizeof(View) +
                           size.lights * sizeof(LightState) +
                           size.worlds * (2 * sizeof(int32_t) + sizeof(GeometryHandle));
  return static_cast<int64_t>(size.num_steps) * static_cast<int64_t>(step);
}

namespace {

class HostSceneHistory final : public SceneHistory {
 public:
  explicit HostSceneHistory(const SceneHistorySize& s) : SceneHistory(s), arrays_(s) {}

  Device device() const override { return {}; }
  SceneBatch scene() const override { return arrays_.scene(device(), num_steps()); }

 private:
  void copy_step(int step, const SceneBatch& scene, Span<const View> views, Stream) override {
    const auto copy = [](const auto& from, auto* first) { std::copy(from.begin(), from.end(), first); };
    const auto shift = [](Span<const int32_t> from, int32_t added, int32_t* first) {
      std::transform(from.begin(), from.end(), first, [added](int32_t begin) { return begin + added; });
    };
    arrays_.write_step(step, scene, views, copy, shift);
  }

  void copy_views(Span<const int64_t> rows, Span<View> views_out, Stream) const override {
    const HistoryViews history = history_views(arrays_.views.data());
    std::transform(rows.begin(), rows.end(), views_out.begin(), [&history](int64_t row) { return history.at(row); });
  }

  SceneHistoryArrays<std::vector> arrays_;
};

}  // namespace

std::unique_ptr<SceneHistory> make_host_scene_history(const SceneHistorySize& size) {
  return std::make_unique<HostSceneHistory>(size);
}

}  // namespace pictura
