// Recorded scenes as training worlds.
#pragma once

#include <future>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "pictura/configuration/config.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/simulator/scene_protocol.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Compiles a scene for worlds of num_agents agents with the configuration `config`. Roles, starts and goals are those
/// of evaluations (evaluation/scene_plan.h). Of the other road users, at most config.parked_cars replay their records:
/// those nearest to driven road users. Returns null if the protocol permits no driven road user. Throws Error for
/// scenes that cannot be read or simulated.
std::shared_ptr<const CompiledMap> compile_training_scene(const SceneRef& scene, const SceneProtocol& protocol,
                                                          SimulatorConfig config, int num_agents);

/// Maps and worlds of one set.
struct SceneSet {
  CompiledMaps maps;
  std::vector<WorldSpec> worlds;
  uint64_t seed = 0;  // seed of its episodes
};

/// Sets of scenes that a run's worlds show in turn. World w of set k shows scene k W + w, modulo the number of scenes;
/// W is the number of worlds of all ranks. The next usable scene replaces an unusable one. A background thread prepares
/// the next set.
class SceneSets {
 public:
  /// `worlds` are this rank's worlds, whose maps are ignored. `world` is their configuration. Throws Error if
  /// simulator.maps contains no scene.
  SceneSets(const Config& config, const SimulatorConfig& world, std::vector<WorldSpec> worlds, int num_all_worlds);
  ~SceneSets();
  SceneSets(const SceneSets&) = delete;
  SceneSets& operator=(const SceneSets&) = delete;

  /// Returns the set that worlds show after this number of updates.
  int64_t set_after(int64_t updates) const { return updates / updates_per_set_; }
  /// Returns a set, and begins to prepare the next one. Throws Error if no scene can be used.
  SceneSet take(int64_t number);
  /// Returns new messages about scenes that were left out.
  std::vector<std::string> take_notices();

 private:
  using Maps = std::map<size_t, std::shared_ptr<const CompiledMap>>;  // by scene

  SceneSet make(int64_t number);
  std::shared_ptr<const CompiledMap> compile(size_t scene, std::string* fault_out) const;

  const SceneProtocol protocol_;
  const SimulatorConfig world_;
  const std::vector<WorldSpec> worlds_;
  const uint64_t seed_;
  const int64_t num_all_worlds_, updates_per_set_;
  const int num_agents_, num_threads_;
  std::vector<SceneRef> scenes_;
  std::vector<std::string> notices_;
  // Members of the preparing thread:
  Maps maps_;
  std::set<size_t> unusable_;
  std::vector<std::string> new_notices_;
  int64_t next_number_ = -1;
  std::future<SceneSet> next_;  // set next_number_
};

}  // namespace pictura
