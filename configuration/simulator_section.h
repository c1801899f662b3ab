// [simulator] of a configuration: the worlds of training.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// A name and a share, as files and options write it: "lane=0.25".
struct NamedShare {
  std::string name;
  double share = 0;
};
/// The name, which may hold the sign, and the share of a text; nullopt without a name, or a share above 0.
std::optional<NamedShare> parse_share(const std::string& text);

/// The simulator's own settings and which worlds there are. Settings that follow from other sections, seed and device
/// for two, count for nothing here: simulator_config() sets them.
struct SimulatorSection : SimulatorConfig {
  std::vector<std::string> other_policies;  // "FILE=SHARE", see parse_share()
  std::string backend = "auto";             // cpu, cuda or auto
  std::vector<std::string> maps{"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
  int map_copies = 0;                    // affine copies of each map, beside it
  int num_slots = 20480;                 // concurrent agents, over all worlds
  int min_agents = 1, max_agents = 120;  // agents per world ~ U{min, max}
};

}  // namespace pictura
