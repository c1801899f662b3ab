// Scene histories on the host: stored scenes are returned with shifted indices, and give the same images as in their
// own step.
#include "pictura/common/scene_history.h"

#include <algorithm>
#include <cstring>
#include <functional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/image_scenes.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::HasSubstr;

constexpr int kSteps = 3;
constexpr std::size_t kWorlds = 4, kAgents = 110, kViews = 10;

struct Step {
  SceneOwner scene;
  std::vector<View> views;
};

const Snapshot& town_of(int map) {
  static const Snapshot towns[] = {make_synthetic_town(11, 50), make_synthetic_town(12, 30)};
  return towns[map];
}

/// Four worlds on two maps, one without agents and another without lights. From step to step, their order, poses and
/// lights change; the number of each stays the same.
Step make_step(int step) {
  struct World {
    int map;
    bool has_agents, has_lights;
  };
  constexpr World kOrder[kWorlds] = {{1, true, true}, {0, false, true}, {0, true, true}, {1, true, false}};
  Step result;
  for (std::size_t i = 0; i < kWorlds; ++i) {
    const World& world = kOrder[(i + static_cast<std::size_t>(step)) % kWorlds];
    const Snapshot& town = town_of(world.map);
    const auto index = static_cast<int32_t>(i), first = static_cast<int32_t>(result.scene.agents.size());
    const float ahead_m = 1.5f * static_cast<float>(step);
    const auto add_view = [&](View view, int32_t ego) {
      view.world = index;
      view.ego_agent = ego;
      view.origin_m = view.origin_m + Vec3{ahead_m * view.cos_heading, ahead_m * view.sin_heading, 0};
      result.views.push_back(view);
    };
    if (world.has_agents) {
      for (AgentBox box : town.scene.agents) {
        box.center_m = box.center_m + Vec3{ahead_m * box.cos_heading, ahead_m * box.sin_heading, 0};
        result.scene.agents.push_back(box);
      }
      for (std::size_t view = 0; view < 3; ++view) add_view(town.views[view], first + town.views[view].ego_agent);
    } else {
      add_view(town.views[0], -1);
    }
    if (world.has_lights) {
      for (const LightState state : town.scene.light_states) {
        result.scene.light_states.push_back(
            static_cast<LightState>((static_cast<int>(state) + step) % kNumLightStates));
      }
    }
    result.scene.end_world(world.map);
  }
  return result;
}

std::size_t lights_of_step() { return make_step(0).scene.light_states.size(); }

SceneHistorySize size_of_steps(int num_steps = kSteps) {
  return {num_steps, kWorlds, kAgents, lights_of_step(), kViews};
}

/// Returns a history with the first steps.
std::unique_ptr<SceneHistory> history_of(int steps) {
  std::unique_ptr<SceneHistory> history = make_host_scene_history(size_of_steps());
  for (int step = 0; step < steps; ++step) {
    const Step its = make_step(step);
    history->put(step, its.scene.batch(), its.views);
  }
  return history;
}

std::vector<View> gathered(const SceneHistory& history, const std::vector<int64_t>& rows) {
  std::vector<View> views(rows.size());
  history.gather(rows, views);
  return views;
}

std::vector<int64_t> all_rows(int steps) {
  std::vector<int64_t> rows(static_cast<std::size_t>(steps) * kViews);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<int64_t>(i);
  return rows;
}

/// Returns the images of these views in one call, a vector for each view.
std::vector<std::vector<uint8_t>> draw(const SceneBatch& scene, const std::vector<View>& views) {
  const Rig rig = paper_rig(48, 27);
  const auto renderer = make_renderer("cpu", {.rig = rig});
  for (const int map : {0, 1}) renderer->upload(map, town_of(map).geometry);
  HostImages images(rig, static_cast<int>(views.size()));
  renderer->render(scene, views, images.batch());
  const auto image_bytes = static_cast<std::ptrdiff_t>(images.bytes().size() / views.size());
  std::vector<std::vector<uint8_t>> result;
  for (const uint8_t* first = images.bytes().begin(); first != images.bytes().end(); first += image_bytes) {
    result.emplace_back(first, first + image_bytes);
  }
  return result;
}

template <typename T>
std::vector<T> values(Span<const T> span) {
  return {span.begin(), span.end()};
}

template <typename T>
bool same_bytes(Span<const T> actual, const T* expected) {
  return std::memcmp(actual.data(), expected, actual.size() * sizeof(T)) == 0;
}

/// Checks that the history holds these steps, with everything after the first step shifted.
void expect_holds(const SceneHistory& history, const std::vector<Step>& steps) {
  const SceneBatch scene = history.scene();
  ASSERT_EQ(scene.geometry.size(), steps.size() * kWorlds);
  ASSERT_EQ(scene.world_begin.size(), steps.size() * kWorlds + 1);
  ASSERT_EQ(scene.light_begin.size(), steps.size() * kWorlds + 1);
  ASSERT_EQ(scene.agents.size(), steps.size() * kAgents);
  ASSERT_EQ(scene.light_states.size(), steps.size() * lights_of_step());
  EXPECT_TRUE(scene.device.is_host());
  EXPECT_TRUE(scene.hidden_agents.empty());
  const std::vector<View> views = gathered(history, all_rows(static_cast<int>(steps.size())));
  for (std::size_t step = 0; step < steps.size(); ++step) {
    SCOPED_TRACE(step);
    const SceneOwner& its = steps[step].scene;
    EXPECT_TRUE(same_bytes(scene.agents.subspan(step * kAgents, kAgents), its.agents.data()));
    EXPECT_TRUE(same_bytes(scene.geometry.subspan(step * kWorlds, kWorlds), its.geometry.data()));
    EXPECT_TRUE(
        same_bytes(scene.light_states.subspan(step * lights_of_step(), lights_of_step()), its.light_states.data()));
    for (std::size_t world = 0; world <= kWorlds; ++world) {
      const std::size_t at = step * kWorlds + world;
      EXPECT_EQ(scene.world_begin[at], its.world_begin[world] + static_cast<int32_t>(step * kAgents)) << world;
      EXPECT_EQ(scene.light_begin[at], its.light_begin[world] + static_cast<int32_t>(step * lights_of_step())) << world;
    }
    for (std::size_t i = 0; i < kViews; ++i) {
      View expected = steps[step].views[i];
      expected.world += static_cast<int32_t>(step * kWorlds);
      if (expected.ego_agent >= 0) expected.ego_agent += static_cast<int32_t>(step * kAgents);
      EXPECT_TRUE(same_bytes(Span<const View>(&views[step * kViews + i], 1), &expected)) << i;
    }
  }
}

TEST(SceneHistory, HoldsAllStoredSteps) {
  const std::unique_ptr<SceneHistory> history = make_host_scene_history(size_of_steps());
  expect_holds(*history, {});
  std::vector<Step> steps;
  for (int step = 0; step < kSteps; ++step) {
    steps.push_back(make_step(step));
    history->put(step, steps.back().scene.batch(), steps.back().views);
    expect_holds(*history, steps);
  }
  ASSERT_NE(values(steps[0].scene.batch().world_begin), values(steps[1].scene.batch().world_begin));
  ASSERT_NE(values(steps[0].scene.batch().light_begin), values(steps[1].scene.batch().light_begin));
}

TEST(SceneHistory, StoringAStepAgainReplacesOnlyThatStep) {
  const std::unique_ptr<SceneHistory> history = history_of(kSteps);
  for (const int step : {1, 0, kSteps - 1}) {
    std::vector<Step> steps;
    for (int i = 0; i < kSteps; ++i) steps.push_back(make_step(i));
    steps[step] = make_step(step + 5);
    const Step& again = steps[step];
    history->put(step, again.scene.batch(), again.views);
    expect_holds(*history, steps);
    const Step before = make_step(step);
    history->put(step, before.scene.batch(), before.views);
  }
}

TEST(SceneHistory, ImagesOfAnyStepsEqualThoseOfTheirScenes) {
  const std::unique_ptr<SceneHistory> history = history_of(kSteps);
  // Every view of every step, in a mixed order (7 and 30 have no common divisor), and some views twice.
  std::vector<int64_t> rows = all_rows(kSteps);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<int64_t>((7 * i + 4) % rows.size());
  rows.insert(rows.end(), {3, 3, 29, 11});
  const auto images = draw(history->scene(), gathered(*history, rows));
  std::vector<std::vector<uint8_t>> own;
  for (int step = 0; step < kSteps; ++step) {
    const Step its = make_step(step);
    for (std::vector<uint8_t>& image : draw(its.scene.batch(), its.views)) own.push_back(std::move(image));
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(images[i], own[rows[i]]) << "row " << rows[i];
  }
  EXPECT_NE(own[0], own[kViews]) << "steps look different";
}

TEST(SceneHistory, RenderersRefuseRowsOfMissingSteps) {
  const std::unique_ptr<SceneHistory> history = history_of(2);
  EXPECT_NO_THROW(draw(history->scene(), gathered(*history, {0, 2 * kViews - 1})));
  for (const int64_t row : {int64_t{2 * kViews}, int64_t{kSteps * kViews}, int64_t{-1}, int64_t{1} << 40}) {
    EXPECT_THAT(message_of([&] { draw(history->scene(), gathered(*history, {0, row})); }),
                HasSubstr("view 1: expected a world below 8"))
        << row;
  }
}

TEST(SceneHistory, InvalidViewsOfAStepAreInvalidInTheHistory) {
  const std::vector<std::function<void(View*)>> damages{
      [](View* view) { view->world = -1; }, [](View* view) { view->world = kWorlds; },
      [](View* view) { view->ego_agent = kAgents; }, [](View* view) { view->ego_agent = -2; },
      [](View* view) { view->hidden_end = 1; }};
  for (std::size_t i = 0; i < damages.size(); ++i) {
    const std::unique_ptr<SceneHistory> history = history_of(kSteps);
    Step damaged = make_step(1);
    damages[i](&damaged.views[4]);
    ASSERT_NE(message_of([&] { draw(damaged.scene.batch(), damaged.views); }), test::kNoError) << i;
    history->put(1, damaged.scene.batch(), damaged.views);
    EXPECT_NE(message_of([&] { draw(history->scene(), gathered(*history, {kViews + 4})); }), test::kNoError) << i;
    EXPECT_NO_THROW(draw(history->scene(), gathered(*history, {kViews + 3, kViews + 5}))) << i;
  }
}

TEST(SceneHistory, ErrorsNameTheDeviceOrSizeThatDiffers) {
  const std::unique_ptr<SceneHistory> history = history_of(1);
  const Step step = make_step(1);
  const auto refusal = [&](const std::function<void(SceneBatch*)>& change) {
    SceneBatch scene = step.scene.batch();
    change(&scene);
    return message_of([&] { history->put(1, scene, step.views); });
  };
  const auto shorter = [](auto span) { return span.subspan(0, span.size() - 1); };
  const int lights = static_cast<int>(lights_of_step());
  EXPECT_EQ(refusal([](SceneBatch* scene) { scene->device = {MemorySpace::cuda, 0}; }),
            "scene history: expected a scene on cpu, got a scene on cuda:0");
  EXPECT_EQ(refusal([&](SceneBatch* scene) { scene->geometry = shorter(scene->geometry); }),
            "scene history: worlds: expected 4 per step, got 3");
  EXPECT_EQ(refusal([&](SceneBatch* scene) { scene->world_begin = shorter(scene->world_begin); }),
            "scene history: world_begin: expected 5 per step, got 4");
  EXPECT_EQ(refusal([&](SceneBatch* scene) { scene->light_begin = shorter(scene->light_begin); }),
            "scene history: light_begin: expected 5 per step, got 4");
  EXPECT_EQ(refusal([&](SceneBatch* scene) { scene->agents = shorter(scene->agents); }),
            "scene history: agents: expected 110 per step, got 109");
  EXPECT_EQ(refusal([&](SceneBatch* scene) { scene->light_states = shorter(scene->light_states); }),
            fmt::format("scene history: lights: expected {} per step, got {}", lights, lights - 1));
  const std::vector<int32_t> hidden{3};
  EXPECT_EQ(refusal([&](SceneBatch* scene) { scene->hidden_agents = hidden; }),
            "scene history: hidden agents: expected 0 per step, got 1");
  std::vector<View> views = step.views;
  views.pop_back();
  EXPECT_EQ(message_of([&] { history->put(1, step.scene.batch(), views); }),
            "scene history: views: expected 10 per step, got 9");
  // Refused steps leave nothing in the history.
  expect_holds(*history, {make_step(0)});
}

TEST(SceneHistory, SkippedStepsAndStepsBeyondTheHistoryAreRefused) {
  const std::unique_ptr<SceneHistory> history = make_host_scene_history(size_of_steps());
  const Step step = make_step(0);
  const auto put = [&](int at) { return message_of([&] { history->put(at, step.scene.batch(), step.views); }); };
  EXPECT_EQ(put(1), "scene history: expected a step of 0 to 0, got 1");
  EXPECT_EQ(put(-1), "scene history: expected a step of 0 to 0, got -1");
  for (int at = 0; at < kSteps; ++at) EXPECT_EQ(put(at), test::kNoError);
  EXPECT_EQ(put(kSteps), "scene history: expected a step of 0 to 2, got 3");
}

TEST(SceneHistory, HasMemoryForOneViewPerRow) {
  const std::unique_ptr<SceneHistory> history = history_of(1);
  std::vector<View> views(2);
  const std::vector<int64_t> rows{0, 1, 2};
  EXPECT_EQ(message_of([&] { history->gather(rows, views); }), "scene history: expected memory for 3 views, got 2");
  EXPECT_NO_THROW(history->gather({}, {}));
}

TEST(SceneHistory, ErrorsNameImpossibleSizes) {
  const auto refusal = [](const SceneHistorySize& size) { return message_of([&] { make_host_scene_history(size); }); };
  constexpr int kMany = 1 << 20;
  EXPECT_EQ(refusal({.num_steps = 0}), "scene history: expected one step or more, got 0");
  EXPECT_EQ(refusal({.num_steps = kMany, .worlds = 1, .agents = 2048}),
            "scene history: expected at most 2147483647 agents, got 2147483648");
  EXPECT_THAT(refusal({.num_steps = kMany, .worlds = 2048}), HasSubstr("at most 2147483647 worlds"));
  EXPECT_THAT(refusal({.num_steps = kMany, .lights = 2048}), HasSubstr("at most 2147483647 lights"));
}

}  // namespace
}  // namespace pictura
