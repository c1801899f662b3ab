// Statistics of the worlds of a map over many episodes: spawned and refused agents, the infractions of a random policy,
// and the progress of a lane-keeping controller. Used by `pictura bench worlds`; not installed.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

struct WorldStatisticsOptions {
  int episodes = 100;  // each the first episode of its own world
  int agents = 120;    // per world of the random policy; the lane-keeping agent is alone among parked cars
  uint64_t seed = 0;
  int num_threads = 0;  // 0: all
  std::function<void(const std::string& phase)> on_progress;
};

/// One quantity, with a value for each episode.
struct EpisodeValues {
  std::string name, unit;
  std::vector<double> values;
};

/// Measures a map. In the default world, with the training timing of lights: agents by class, refusals by reason,
/// unreachable goals, and the events of a uniformly random policy until the episode ends. With evaluation's lights: the
/// results of the lane-keeping controller within the maximum length of an episode.
std::vector<EpisodeValues> measure_worlds(const std::shared_ptr<const RoadMap>& map,
                                          const WorldStatisticsOptions& options);

}  // namespace pictura
