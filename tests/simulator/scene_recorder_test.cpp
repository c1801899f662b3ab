// Simulated runs saved as recorded scenes and replayed.
#include "pictura/simulator/scene_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/support/file.h"
#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::HasSubstr;

constexpr int kRecordedSteps = 60;

std::unique_ptr<Simulator> town() {
  const SimulatorConfig config{.seed = 3, .num_threads = 1, .parked_cars = 4};
  return make_simulator("cpu", config, {load_map("procedural:3")}, {{0, 3, 0}, {0, 20, 1}});
}

Span<const AgentBox> boxes_of(Simulator& simulator, size_t world) {
  const SceneBatch& scene = simulator.scene();
  const auto begin = static_cast<size_t>(scene.world_begin[world]);
  return scene.agents.subspan(begin, static_cast<size_t>(scene.world_begin[world + 1]) - begin);
}

/// Drives the second world and records its boxes at each step.
Scenario drive(Simulator& simulator, std::vector<std::vector<AgentBox>>* boxes_out) {
  SceneRecorder recorder(simulator, 1);
  const auto keep = [&] {
    const Span<const AgentBox> boxes = boxes_of(simulator, 1);
    boxes_out->emplace_back(boxes.begin(), boxes.end());
  };
  keep();
  for (uint32_t step = 0; step < kRecordedSteps; ++step) {
    recorder.after_step(simulator.step(testing::mixed_actions(simulator.num_slots(), step)));
    keep();
  }
  EXPECT_EQ(recorder.num_steps(), kRecordedSteps + 1);
  return recorder.scenario();
}

TEST(SceneRecorder, RecordsEachLifeAsATrack) {
  const SimulatorConfig config{.num_threads = 1, .pedestrian_fraction = 0, .cyclist_fraction = 0, .parked_cars = 0};
  const auto street = std::make_shared<RoadMap>(parse_opendrive(test::open_street(120), "street.xodr"));
  const auto simulator = make_simulator("cpu", config, {street}, {{0, 6, 0}});
  const auto driver = make_controller("idm_lanes", *simulator, 0);
  SceneRecorder recorder(*simulator);
  std::vector<Command> commands(6);
  for (int step = 0; step < 300; ++step) {
    driver->act(simulator->arrays(), {}, commands);
    recorder.after_step(simulator->step(Span<const Command>(commands)));
  }
  const SpawnReport report = simulator->spawn_report();
  ASSERT_GT(report.entered, 4);
  const Scenario scene = recorder.scenario();
  ASSERT_EQ(static_cast<int64_t>(scene.tracks.size()), report.spawned + report.entered);
  const auto steps = static_cast<size_t>(scene.num_steps);
  for (size_t i = 0; i < scene.tracks.size(); ++i) {
    const RecordedTrack& track = scene.tracks[i];
    EXPECT_EQ(track.num_valid, track.last_valid - track.first_valid + 1) << "without gaps";
    for (auto step = static_cast<size_t>(track.first_valid) + 1; step <= static_cast<size_t>(track.last_valid);
         ++step) {
      const Vec3 way = scene.states[i * steps + step].position_m - scene.states[i * steps + step - 1].position_m;
      EXPECT_LT(length(way), 2.1f) << "no jumps";
    }
  }
  // Tracks of one slot differ in size.
  EXPECT_NE(scene.tracks.front().length_m, scene.tracks.back().length_m);
}

TEST(SceneRecorder, RecordedDrivesAreSavedLoadedAndReplayed) {
  const test::ScratchFolder folder;
  const auto simulator = town();
  std::vector<std::vector<AgentBox>> boxes;
  const Scenario driven = drive(*simulator, &boxes);
  const std::string path = folder.path() + "/drive.scenario";
  write_scene_file(path, driven);
  ASSERT_TRUE(is_scene_name(path));
  const auto scene = std::make_shared<const Scenario>(load_scenario(path));
  EXPECT_EQ(first_difference(driven, *scene), "");
  EXPECT_EQ(scene->format, "pictura");
  EXPECT_EQ(scene->id, "procedural:3 seed 3 world 1 episode 0");
  EXPECT_EQ(scene->num_steps, kRecordedSteps + 1);
  EXPECT_EQ(index_scenes(folder.path()).scenes.size(), 1u);

  const SimulatorConfig config = scene_config(*scene, 0, {.num_threads = 1});
  const auto map = compile_scenario(scene, map_options(config));
  const auto replay = make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map)});
  const auto log = make_controller("log", *replay, 0);
  std::vector<Command> commands(scene->tracks.size());
  int compared = 0, moved = 0;
  for (size_t step = 0; step <= kRecordedSteps; ++step) {
    for (size_t track = 0; track < scene->tracks.size(); ++track) {
      SCOPED_TRACE(::testing::Message() << "track " << track << ", step " << step);
      const auto box_index = static_cast<size_t>(scene->tracks[track].id);
      const AgentBox &was = boxes[step][box_index], &is = boxes_of(*replay, 0)[track];
      ASSERT_EQ(was.drawn, is.drawn);
      if (!was.drawn) continue;
      ++compared;
      moved += step > 0 && length(was.center_m - boxes[step - 1][box_index].center_m) > 0.1f;
      if (box_index < 20) {  // agents that drove: equal bits
        ASSERT_EQ(was.center_m.x, is.center_m.x);
        ASSERT_EQ(was.center_m.y, is.center_m.y);
        ASSERT_EQ(was.center_m.z, is.center_m.z);
        ASSERT_EQ(was.cos_heading, is.cos_heading);
        ASSERT_EQ(was.sin_heading, is.sin_heading);
      } else {  // parked cars, whose heights are recomputed at their reference points
        ASSERT_LT(length((was.center_m - is.center_m).xy()), 1e-4f);
        ASSERT_LT(std::abs(was.center_m.z - is.center_m.z), 0.2f);
        ASSERT_LT(std::abs(was.cos_heading - is.cos_heading) + std::abs(was.sin_heading - is.sin_heading), 1e-6f);
      }
      ASSERT_EQ(was.length_m, is.length_m);
      ASSERT_EQ(was.agent_class, is.agent_class);
    }
    log->act(replay->arrays(), {}, commands, {});
    if (step < kRecordedSteps) replay->step(Span<const Command>(commands));
  }
  EXPECT_GT(compared, 20 * kRecordedSteps);
  EXPECT_GT(moved, 3 * kRecordedSteps);
}

TEST(SceneRecorder, LightsBecomeRecordedOnes) {
  const auto simulator = town();
  ASSERT_FALSE(simulator->maps()[0]->road->lights.empty());
  std::vector<std::vector<AgentBox>> boxes;
  const Scenario driven = drive(*simulator, &boxes);
  ASSERT_EQ(driven.lights.size(), simulator->maps()[0]->road->lights.size());
  EXPECT_TRUE(driven.map.lights.empty());
  const auto last = static_cast<size_t>(kRecordedSteps);
  const SceneBatch& scene = simulator->scene();
  for (int32_t light = 0; light < static_cast<int32_t>(driven.lights.size()); ++light) {
    const LightState state = scene.light_states[scene.light_begin[1] + light];
    const RecordedLightState expected = state == LightState::red      ? RecordedLightState::stop
                                        : state == LightState::yellow ? RecordedLightState::caution
                                        : state == LightState::green  ? RecordedLightState::go
                                                                      : RecordedLightState::none;
    EXPECT_EQ(driven.states_of_light(light)[last], expected) << light;
  }
}

TEST(SceneRecorder, AReplayedRecordingEqualsTheRecording) {
  const auto scene = test::crossing();
  const SimulatorConfig config = scene_config(*scene, 5, {.num_threads = 1});
  MapOptions options = map_options(config);
  options.recorded_lights = true;  // has no effect on saved scenes
  const auto map = compile_scenario(scene, options, 5);
  const auto simulator = make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map)});
  const auto log = make_controller("log", *simulator, 0);
  std::vector<Command> commands(scene->tracks.size());
  SceneRecorder recorder(*simulator);
  for (int step = 0; step < 40; ++step) {
    log->act(simulator->arrays(), {}, commands, {});
    recorder.after_step(simulator->step(Span<const Command>(commands)));
  }
  const Scenario again = recorder.scenario("again");
  EXPECT_EQ(again.id, "again");
  ASSERT_LE(again.tracks.size(), scene->tracks.size());
  EXPECT_EQ(again.tracks[again.sdc_track].id, scene->tracks[scene->sdc_track].id);
  ASSERT_EQ(again.lights.size(), scene->lights.size());
  for (int32_t light = 0; light < static_cast<int32_t>(again.lights.size()); ++light) {
    for (size_t step = 0; step <= 40; ++step) {
      ASSERT_EQ(again.states_of_light(light)[step], scene->states_of_light(light)[step + 5]);
    }
  }
  for (int32_t track = 0; track < static_cast<int32_t>(again.tracks.size()); ++track) {
    int32_t original = 0;
    while (scene->tracks[original].id != again.tracks[track].id) ++original;
    for (size_t step = 0; step <= 40; ++step) {
      ASSERT_EQ(again.valid_of(track)[step], scene->valid_of(original)[step + 5]);
      if (!again.valid_of(track)[step]) continue;
      const Vec3 was = scene->states_of(original)[step + 5].position_m, is = again.states_of(track)[step].position_m;
      ASSERT_LT(length((was - is).xy()), 1e-3f);
    }
  }
}

TEST(SceneRecorder, EndsWithTheEpisodeAndRefusesUnsupportedWorlds) {
  const SimulatorConfig config{.num_threads = 1, .episode_steps = 5};
  const auto simulator = make_simulator("cpu", config, {load_map("procedural:3")}, {{0, 4, 0}});
  SceneRecorder recorder(*simulator);
  const std::vector<int32_t> actions(4, kIdleAction);
  for (int step = 0; step < 8; ++step) {
    recorder.after_step(simulator->step(actions));
    EXPECT_EQ(recorder.is_over(), step >= 5);
  }
  EXPECT_EQ(recorder.scenario().num_steps, 6);
  SceneRecorder cut(*simulator);
  simulator->reset();
  cut.after_reset({});
  EXPECT_TRUE(cut.is_over());
  EXPECT_THAT(message_of<UsageError>([&] { SceneRecorder(*simulator, 1); }), HasSubstr("in [0, 1), got 1"));
  EXPECT_THAT(message_of<UsageError>([&] { cut.scenario("", 400); }), HasSubstr("got 400"));
}

TEST(SceneFile, ErrorsNameDamagedAndForeignFiles) {
  const test::ScratchFolder folder;
  const std::string path = folder.path() + "/x.scenario";
  write_scene_file(path, *test::crossing());
  const std::string bytes = read_file(path);
  const auto message = [](const std::string& damaged) {
    return message_of([&] { parse_scene_file(damaged, "x.scenario"); });
  };
  EXPECT_EQ(message(bytes), test::kNoError);
  EXPECT_THAT(message(bytes.substr(0, 20)), HasSubstr("x.scenario: truncated"));
  EXPECT_THAT(message(bytes.substr(0, bytes.size() - 1)), HasSubstr("truncated"));
  EXPECT_THAT(message("{}" + bytes), HasSubstr("foreign"));
  std::string flipped = bytes;
  flipped[bytes.size() / 2] ^= 1;
  EXPECT_THAT(message(flipped), HasSubstr("checksum"));
  std::string other = bytes;
  other[16] ^= 1;  // in the layout's hash
  EXPECT_THAT(message(other), HasSubstr("written by another version of pictura"));
  EXPECT_THAT(message_of<UsageError>([&] { write_scene_file(folder.path() + "/x.json", *test::crossing()); }),
              HasSubstr("expected a file *.scenario"));
}

}  // namespace
}  // namespace pictura
