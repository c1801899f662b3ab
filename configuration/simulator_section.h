// Section [simulator] of a configuration.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/simulator/scene_protocol.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// A name with a share, written as "lane=0.25".
struct NamedShare {
  std::string name;
  double share = 0;
};
/// Parses "NAME=SHARE"; NAME may contain "=". Returns nullopt if the name is missing or the share is not above 0.
std::optional<NamedShare> parse_share(const std::string& text);

/// [simulator.scenes]: training worlds of recorded scenes.
struct SceneSection {
  // Name of a SceneProtocol.
  std::string protocol = "gpudrive";
  std::string control;             // road users that the policy drives; empty: the protocol's
  std::vector<std::string> rules;  // "NAME=VALUE", see set_scene_rule()
  int max_replayed = 96;           // maximum number, per world, of road users that follow the recording
  int64_t updates_per_set = 8;     // updates after which the worlds change to the next scenes

  /// Returns the protocol with these changes. Throws UsageError, which names the key, for an invalid value.
  SceneProtocol training_protocol() const;
};

/// Settings of the simulator and its worlds. simulator_config() sets members that follow from other sections, such as
/// seed and device.
struct SimulatorSection : SimulatorConfig {
  std::vector<std::string> other_policies;  // "FILE=SHARE", see parse_share()
  std::string backend = "auto";             // cpu, cuda or auto
  std::vector<std::string> maps{"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
  int map_copies = 0;                    // affine copies of each map
  int num_slots = 20480;                 // concurrent agents in all worlds
  int min_agents = 1, max_agents = 120;  // agents in a world: U{min, max}
  SceneSection scenes;

  /// Whether simulator.maps contains recorded scenes.
  bool has_scenes() const;
};

/// Returns NAME of a map "scenes:NAME" (see find_scenes()), or nullopt.
std::optional<std::string> scene_source(const std::string& map);
std::string map_of_scenes(const std::string& source);

}  // namespace pictura
