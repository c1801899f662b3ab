// Worlds for benchmarks in which some requested agents cannot be spawned.
#include "pictura/bench/driving.h"

#include <gtest/gtest.h>

#include "pictura/bench/quality.h"
#include "pictura/common/error.h"

namespace pictura {
namespace {

constexpr const char* kHamlet = "procedural:1:blocks=1x1";
constexpr int kMany = 600;

TEST(Driving, AgentsThatFailToSpawnAreNotDrawn) {
  const Snapshot snapshot = drive_snapshot({.map = kHamlet, .agents = kMany, .steps = 0, .views = kMany});
  EXPECT_GT(snapshot.views.size(), 0u);
  EXPECT_LT(snapshot.views.size(), static_cast<std::size_t>(kMany));
  for (const View& view : snapshot.views) {
    ASSERT_GE(view.ego_agent, 0);
    EXPECT_TRUE(snapshot.scene.agents[view.ego_agent].drawn);
  }
}

TEST(Driving, TooFewSpawnedAgentsAreAnError) {
  EXPECT_NO_THROW(drive_worlds({.maps = {kHamlet}, .num_views = 8, .agents = 8, .steps = 1}));
  EXPECT_THROW(drive_worlds({.maps = {kHamlet}, .num_views = kMany, .agents = kMany, .steps = 1}), Error);
}

}  // namespace
}  // namespace pictura
