// Recording of a simulated world as a scene, so that other agents can later drive among the recorded traffic.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Records one episode of a world. The controlled agents and then the parked cars become the tracks of a scene. Light
/// states become its recorded lights. The simulator must work in host memory.
class SceneRecorder final : public StepObserver {
 public:
  /// Records the simulator's current state as the first step. The simulator must outlive the recorder. Throws
  /// UsageError if the simulator does not work in host memory, or if it has no such world.
  explicit SceneRecorder(Simulator& simulator, int world = 0);

  /// Records a step of the episode; steps after the episode are ignored. Throws Error if the scene would become too
  /// long.
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  /// Whether the recorded episode is over.
  bool is_over() const { return is_over_; }
  int32_t num_steps() const { return num_steps_; }

  /// Returns the scene so far. Its tracks are the agents that were present at any step. The id of a track is the index
  /// of the agent's box in the world. On roads that end, each life is a track: life k of box b (both counted from 0)
  /// has the id b + k * (number of boxes). self_agent is the agent whose track is the self-driving car; -1: none. In a
  /// world of a recorded scene, ids, types, recorded lights and the self-driving car are those of that scene. An empty
  /// `id` is replaced by an id made of map name, seed, world and episode. Throws UsageError if self_agent was never
  /// present.
  Scenario scenario(std::string id = "", int self_agent = -1) const;

 private:
  Span<const AgentBox> boxes() const;
  /// Records the current state if the simulator took another step of the recorded episode.
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
