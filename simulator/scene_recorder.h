// A world of a simulator, step by step, as a recorded scene: what was driven becomes traffic that others meet again.
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
/// lights, which become recorded ones.
class SceneRecorder final : public StepObserver {
 public:
  /// The state of the simulator, which must outlive the recorder, is the first step. Throws UsageError where the
  /// simulator does not work in host memory or has no such world.
  explicit SceneRecorder(Simulator& simulator, int world = 0);

  /// What follows the episode is left out. Throws Error where a scene may not be so long.
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  /// Whether the episode that it records is over.
  bool is_over() const { return is_over_; }
  int32_t num_steps() const { return num_steps_; }

  /// The scene until now: agents that were there at any step, with the number of their box in the world as id. On roads
  /// that end each life is a track; life k has the id of the first one and k times the number of boxes.
  /// self_agent: whose track is the self-driving car's; -1: nobody's. In a world of a recorded scene ids, types,
  /// recorded lights and the self-driving car are that one's. An empty id becomes one of the map's name, seed, world
  /// and episode. Throws UsageError for an agent that was never there.
  Scenario scenario(std::string id = "", int self_agent = -1) const;

 private:
  Span<const AgentBox> boxes() const;
  /// After whatever may have been a step of the episode.
  void follow();
  void add_step();

  Simulator& simulator_;
  size_t world_;
  WorldSpec spec_;
  std::shared_ptr<const CompiledMap> map_;
  uint64_t seed_;
  int32_t first_slot_ = 0, episode_ = 0, first_step_ = 0, num_steps_ = 0;
  bool is_over_ = false;
  std::vector<std::vector<AgentBox>> bodies_;  // [boxes][lives] where they were last seen
  std::vector<TrackState> states_;             // [steps, boxes]
  std::vector<SavedMotion> driven_;            // [steps, boxes]
  std::vector<uint8_t> valid_;                 // [steps, boxes]
  std::vector<int32_t> life_;                  // [steps, boxes]
  std::vector<RecordedLightState> lights_;     // [steps, lights]
};

}  // namespace pictura
