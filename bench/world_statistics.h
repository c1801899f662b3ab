// Statistics of the worlds of a map over many episodes: spawned and refused agents, the infractions of a random policy,
// and the progress of a lane-keeping controller. `pictura bench worlds` uses this header; it is not installed.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

struct WorldStatisticsOptions {
  int episodes = 100;  // each episode is the first episode of a world
  int agents = 120;    // agents per world of the random policy; the lane-keeping agent is alone among parked cars
  uint64_t seed = 0;
  int num_threads = 0;  // 0: all
  std::function<void(const std::string& phase)> on_progress;
};

/// One quantity, with a value for each episode.
struct EpisodeValues {
  std::string name, unit;
  std::vector<double> values;
};

/// Measures a map. Counts agents by class, refusals by reason, unreachable goals, and the events of a uniformly random
/// policy until the episode ends, in worlds with default options and the light timing of training. Measures the
/// lane-keeping controller in worlds with the light timing of evaluations, up to the maximum length of an episode.
std::vector<EpisodeValues> measure_worlds(const std::shared_ptr<const RoadMap>& map,
                                          const WorldStatisticsOptions& options);

}  // namespace pictura
