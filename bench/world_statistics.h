// Statistics of a map's worlds over many episodes.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

struct WorldStatisticsOptions {
  int episodes = 100;  // each is a world's first episode
  int agents = 120;    // per world of the random policy; a world of the lane keeper has one agent and parked cars
  uint64_t seed = 0;
  int num_threads = 0;  // 0: all
  std::function<void(const std::string& phase)> on_progress;
};

struct EpisodeValues {
  std::string name, unit;
  std::vector<double> values;
};

/// Counts spawned agents (by class), agents without a place (by reason), unreachable waypoints, and the events of a
/// random policy in whole episodes. These counts use default options and the light timing of training. Measures the
/// lane-keeping controller with the light timing of evaluations, up to the maximum length of an episode.
std::vector<EpisodeValues> measure_worlds(const std::shared_ptr<const RoadMap>& map,
                                          const WorldStatisticsOptions& options);

}  // namespace pictura
