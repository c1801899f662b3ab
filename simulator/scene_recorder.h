// Recording of a simulated world as a scene, step by step, so that driven traffic can be replayed to other agents.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Records one episode of a world in host memory: controlled agents, then parked cars, as tracks, and the states of its
/// lights as recorded lights.
class SceneRecorder final : public StepObserver {
 public:
  /// Records the simulator's state as the first step; the simulator must outlive the recorder. Throws UsageError if the
  /// simulator does not work in host memory or lacks the world.
  explicit SceneRecorder(Simulator& simulator, int world = 0);

  /// Records a step of the episode; steps after the episode are ignored. Throws Error if the scene would become too
  /// long.
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  /// Whether the recorded episode is over.
  bool is_over() const { return is_over_; }
  int32_t num_steps() const { return num_steps_; }

  /// Returns the scene so far. Its tracks are the agents that were present at any step; their ids are the indices of
  /// their boxes in the world. On roads that end, each life is a track; the id of life k is that of the first life plus
  /// k times the number of boxes. self_agent: agent of the self-driving car's track; -1: none. In a world of a recorded
  /// scene, ids, types, recorded lights and the self-driving car are those of that scene. An empty id is replaced by
  /// one of the map's name, seed, world and episode. Throws UsageError for an agent that was never present.
  Scenario scenario(std::string id = "", int self_agent = -1) const;

 private:
  Span<const AgentBox> boxes() const;
  /// Called after every event that may have been a step of the episode.
  void follow();
  void add_step();

  Simulator& simulator_;
  size_t world_;
  WorldSpec spec_;
  std::shared_ptr<const CompiledMap> map_;
  uint64_t seed_;
  int32_t first_slot_ = 0, episode_ = 0, first_step_ = 0, num_steps_ = 0;
  bool is_over_ = false;
  std::vector<std::vector<AgentBox>> bodies_;  // [boxes][lives] last visible state
  std::vector<TrackState> states_;             // [steps, boxes]
  std::vector<SavedMotion> driven_;            // [steps, boxes]
  std::vector<uint8_t> valid_;                 // [steps, boxes]
  std::vector<int32_t> life_;                  // [steps, boxes]
  std::vector<RecordedLightState> lights_;     // [steps, lights]
};

}  // namespace pictura
