// What happens in the worlds of a map over many episodes: who is there and who is refused, what a random policy does
// wrong, and how far a lane-keeping controller gets. Used by `pictura bench worlds` and by nothing that is installed.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

struct WorldStatisticsOptions {
  int episodes = 100;  // each the first one of a world of its own
  int agents = 120;    // in each world of the random policy; the lane-keeping agent is alone among parked cars
  uint64_t seed = 0;
  int num_threads = 0;  // 0: all
  std::function<void(const std::string& phase)> on_progress;
};

/// One quantity, with a value for each episode.
struct EpisodeValues {
  std::string name, unit;
  std::vector<double> values;
};

/// In the default world, at the training timing of lights: agents by class, refusals by reason, goals that cannot be
/// reached, and the events of a uniformly random policy until the episode ends. In evaluation's lights: what the
/// lane-keeping controller reaches in as many steps as an episode has at most.
std::vector<EpisodeValues> measure_worlds(const std::shared_ptr<const RoadMap>& map,
                                          const WorldStatisticsOptions& options);

}  // namespace pictura
