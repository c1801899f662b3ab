// Recorded scenes as training worlds: which scenes the worlds show, and their preparation while training continues.
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

/// Compiles a scene for worlds of num_agents agents. Roles, starts and goals are those of evaluations
/// (evaluation/scene_plan.h), see with_tracks(). Road users beyond num_agents follow their records. Keeps at most
/// config.parked_cars of the road users that follow their records: those nearest to driven road users. `config` is the
/// configuration of the worlds. Returns null if the protocol allows no road user to be driven. Throws Error for scenes
/// that cannot be read or simulated.
std::shared_ptr<const CompiledMap> compile_training_scene(const SceneRef& scene, const SceneProtocol& protocol,
                                                          SimulatorConfig config, int num_agents);

/// Maps and worlds of one set of scenes.
struct SceneSet {
  CompiledMaps maps;
  std::vector<WorldSpec> worlds;
  uint64_t seed = 0;  // seed of the set's episodes
};

/// Sets of scenes that the worlds of a run show in turn. World w of set k shows scene k W + w, where W is the number of
/// worlds over all ranks; after the last scene, the count continues with the first. A scene that cannot be used is
/// replaced by the next usable scene. The host holds two sets: the current one, and the next, which is prepared in the
/// background.
class SceneSets {
 public:
  /// Finds the scenes of simulator.maps. `worlds` are the worlds of this rank; their maps are ignored. `world` is their
  /// configuration. Throws Error if there is no scene.
  SceneSets(const Config& config, const SimulatorConfig& world, std::vector<WorldSpec> worlds, int num_all_worlds);
  ~SceneSets();
  SceneSets(const SceneSets&) = delete;
  SceneSets& operator=(const SceneSets&) = delete;

  /// Number of the set that worlds show after this number of updates.
  int64_t set_after(int64_t updates) const { return updates / updates_per_set_; }
  /// Waits until a set is prepared and returns it. Begins to prepare the next set. Throws Error if no scene can be
  /// used.
  SceneSet take(int64_t number);
  /// Returns the messages about scenes that were left out since the last call.
  std::vector<std::string> take_notices();

 private:
  using Maps = std::map<size_t, std::shared_ptr<const CompiledMap>>;  // key: number of the scene

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
  // Members that only the preparing thread uses:
  Maps maps_;                  // maps of the last prepared set
  std::set<size_t> unusable_;  // scenes that cannot be used
  std::vector<std::string> new_notices_;
  int64_t next_number_ = -1;
  std::future<SceneSet> next_;  // set number next_number_, if the future is valid
};

}  // namespace pictura
