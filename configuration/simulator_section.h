// Section [simulator] of a configuration: the training worlds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/simulator/scene_protocol.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// A name with a share, which files and options write as "lane=0.25".
struct NamedShare {
  std::string name;
  double share = 0;
};
/// Parses a text "NAME=SHARE". The name may contain "=". Returns nullopt if there is no name or no share above 0.
std::optional<NamedShare> parse_share(const std::string& text);

/// [simulator.scenes]: training worlds of recorded scenes.
struct SceneSection {
  // Name of the SceneProtocol that defines roles, goals and consequences of infractions.
  std::string protocol = "gpudrive";
  std::string control;             // road users that the policy drives; empty: as in the protocol
  std::vector<std::string> rules;  // "NAME=VALUE": replace rules of the protocol, see set_scene_rule()
  int max_replayed = 96;           // maximum number, per world, of road users that follow the recording
  int64_t updates_per_set = 8;     // number of updates after which the worlds change to the next scenes

  /// Returns the protocol with these changes. Throws UsageError, which names the key (without its section), for an
  /// invalid value.
  SceneProtocol training_protocol() const;
};

/// Settings of the simulator and its worlds. Members of SimulatorConfig that follow from other sections, such as seed
/// and device, are ignored here; simulator_config() sets them.
struct SimulatorSection : SimulatorConfig {
  std::vector<std::string> other_policies;  // "FILE=SHARE", see parse_share()
  std::string backend = "auto";             // cpu, cuda or auto
  std::vector<std::string> maps{"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
  int map_copies = 0;                    // number of affine copies of each map, in addition to the map
  int num_slots = 20480;                 // total number of concurrent agents in all worlds
  int min_agents = 1, max_agents = 120;  // number of agents in a world, drawn from U{min, max}
  SceneSection scenes;

  /// Whether the worlds are recorded scenes: simulator.maps contains names that scene_source() accepts.
  bool has_scenes() const;
};

/// Returns NAME of a map "scenes:NAME" in simulator.maps, for find_scenes(). Returns nullopt for other maps.
std::optional<std::string> scene_source(const std::string& map);
/// Inverse of scene_source().
std::string map_of_scenes(const std::string& source);

}  // namespace pictura
