// Scenes of other projects, if they are available. Reading them gives everything that docs/research/maps.md and the
// formats' own pages document.
#include <cstdlib>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/load_scenario.h"

namespace pictura {
namespace {

#define SAMPLE_OR_SKIP(path, name)                            \
  const std::string path = map_folder() + "/" + (name);       \
  if (!std::filesystem::exists(path))                         \
  GTEST_SKIP() << path                                        \
               << " is missing: its format is read by tests " \
                  "of our own fixtures alone"

/// Checks that logged moving vehicles hardly touch edges and are on the road.
void expect_on_road(const Scenario& scenario, double most_off_road = 0.02) {
  const LoggedDriving driving = logged_driving(scenario);
  const auto steps = static_cast<double>(driving.vehicle_steps);
  fmt::print("{}: {} moving vehicle-steps, {:.3f} % touch an edge, {:.3f} % are off the road\n", scenario.format,
             driving.vehicle_steps, 100 * static_cast<double>(driving.touching) / steps,
             100 * static_cast<double>(driving.off_road) / steps);
  EXPECT_GT(driving.vehicle_steps, 100);
  EXPECT_LE(static_cast<double>(driving.touching), 0.02 * steps);
  EXPECT_LE(static_cast<double>(driving.off_road), most_off_road * steps);
}

TEST(SceneSamples, Womd) {
  SAMPLE_OR_SKIP(path, "womd/womd_scenario_input.tfrecord");
  const Scenario scenario = load_scenario(path);
  EXPECT_EQ(scenario.id, "ee519cf571686d19");
  EXPECT_EQ(scenario.num_steps, 91);
  EXPECT_EQ(scenario.current_step, 10);
  const ScenarioFacts facts = facts_of(scenario);
  EXPECT_EQ(facts.vehicles, 189);
  EXPECT_EQ(facts.pedestrians, 68);
  EXPECT_EQ(facts.tracks_with_gaps, 257 - 164);
  EXPECT_EQ(scenario.map.lanes.size(), 114u);
  EXPECT_EQ(scenario.lights.size(), 0u);
  int links = 0;
  for (const Lane& lane : scenario.map.lanes) links += lane.successors.size();
  EXPECT_EQ(links, 134);
  expect_on_road(scenario);
}

TEST(SceneSamples, GpuDrive) {
  SAMPLE_OR_SKIP(first, "gpudrive/tfrecord-00000-of-01000_4.json");
  const Scenario scenario = load_scenario(first);
  EXPECT_EQ(scenario.id, "db4edc9bd0c9d18c");
  EXPECT_EQ(scenario.tracks.size(), 81u);
  EXPECT_EQ(scenario.sdc_track, 80);
  EXPECT_EQ(scenario.tracks_to_predict.size(), 7u);
  int experts = 0;
  for (const RecordedTrack& track : scenario.tracks) experts += track.control == RecordedControl::expert ? 1 : 0;
  EXPECT_EQ(experts, 41);
  EXPECT_EQ(scenario.map.lanes.size(), 37u);
  expect_on_road(scenario);
  expect_on_road(load_scenario(map_folder() + "/gpudrive/tfrecord-00000-of-01000_325.json"));
}

TEST(SceneSamples, PufferDriveV1) {
  SAMPLE_OR_SKIP(path, "pufferdrive/map_000.bin");
  const Scenario scenario = load_scenario(path);
  EXPECT_EQ(scenario.format, "pufferdrive v1");
  EXPECT_EQ(scenario.tracks.size(), 64u);
  EXPECT_EQ(scenario.map.lanes.size(), 17u);
  // Track 37 is a car that stands 17 m beside the road and whose recorded position drifts by more than 2 m.
  expect_on_road(scenario, 0.07);
}

TEST(SceneSamples, PufferDriveTown) {
  SAMPLE_OR_SKIP(path, "pufferdrive/Town01_0.json");
  const Scenario scenario = load_scenario(path);
  EXPECT_EQ(scenario.map.lanes.size(), 124u);
  int endless = 0;
  for (const Lane& lane : scenario.map.lanes) endless += lane.is_endless ? 1 : 0;
  EXPECT_EQ(endless, 124) << "the town's roads are loops";
}

}  // namespace
}  // namespace pictura
