// Recording of a simulated world as a scene, in which other agents can drive later.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Records one episode of a world. Controlled agents and parked cars become tracks.
class SceneRecorder final : public StepObserver {
 public:
  /// Records the current state as the first step. The simulator must outlive the recorder. Throws UsageError if the
  /// simulator does not work in host memory or has no such world.
  explicit SceneRecorder(Simulator& simulator, int world = 0);

  /// Ignores steps after the episode. Throws Error if the scene would become too long.
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  bool is_over() const { return is_over_; }
  int32_t num_steps() const { return num_steps_; }

  /// Returns the scene so far. Each box that was present at any step has a track, whose id is its index in the world.
  /// On open maps, each life has a track: life k of box b (counted from 0) has the id b + k * (number of boxes).
  /// self_agent is the self-driving car; -1: none. In a world of a recorded scene, ids, types and lights are those of
  /// that scene; with self_agent -1, so is the self-driving car. An empty `id` becomes map name, seed, world and
  /// episode. Throws UsageError if self_agent was never present.
  Scenario scenario(std::string id = "", int self_agent = -1) const;

 private:
  Span<const AgentBox> boxes() const;
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
