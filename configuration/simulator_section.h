// Section [simulator] of a configuration: the training worlds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/simulator/scene_protocol.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Name with a share, as files and options write it: "lane=0.25".
struct NamedShare {
  std::string name;
  double share = 0;
};
/// Parses a text into a name, which may contain "=", and a share; nullopt without a name, or without a share above 0.
std::optional<NamedShare> parse_share(const std::string& text);

/// [simulator.scenes]: training worlds of recorded scenes.
struct SceneSection {
  std::string protocol = "gpudrive";  // name of a SceneProtocol, whose roles, goals and consequences hold
  std::string control;                // road users that the policy drives, instead of the protocol's
  std::vector<std::string> rules;     // "NAME=VALUE", instead of the protocol's, see set_scene_rule()
  int max_replayed = 96;              // road users that follow the recording, in a world
  int64_t updates_per_set = 8;        // updates after which the worlds take the next scenes

  /// Returns the protocol with these changes. Throws UsageError naming the key without its section.
  SceneProtocol training_protocol() const;
};

/// Simulator settings and the number of worlds. Settings that follow from other sections, such as seed and device, are
/// ignored here: simulator_config() sets them.
struct SimulatorSection : SimulatorConfig {
  std::vector<std::string> other_policies;  // "FILE=SHARE", see parse_share()
  std::string backend = "auto";             // cpu, cuda or auto
  std::vector<std::string> maps{"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
  int map_copies = 0;                    // affine copies of each map, in addition to it
  int num_slots = 20480;                 // concurrent agents, over all worlds
  int min_agents = 1, max_agents = 120;  // agents per world ~ U{min, max}
  SceneSection scenes;

  /// Whether the worlds are recorded scenes: maps are names of scene_source().
  bool has_scenes() const;
};

/// The scenes that "scenes:NAME" in simulator.maps stands for, as find_scenes() takes them; nullopt for other maps.
std::optional<std::string> scene_source(const std::string& map);
/// Inverse of scene_source().
std::string map_of_scenes(const std::string& source);

}  // namespace pictura
