// Recorder of one world of a simulator in host memory.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/image.h"
#include "pictura/common/renderer.h"
#include "pictura/replay/replay.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

struct RecorderOptions {
  int world = 0;
  int followed = -1;                        // slot in the world whose agents have decisions and images; -1: none
  RendererConfig cameras;                   // for viewers
  bool keeps_images = false;                // drawn by the CPU renderer
  int64_t max_numbers = kMaxReplayNumbers;  // maximum number of track values
};

class AgentCameras {
 public:
  /// Renders on the host with exact coverage. The simulator must outlive this object.
  AgentCameras(Simulator& simulator, RendererConfig config);
  ~AgentCameras();

  /// Returns the view of a slot's agent: [height, width, 3] bytes per camera.
  std::string draw(int slot);

 private:
  Simulator& simulator_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<HostImages> images_;
};

std::vector<ReplayCamera> replay_cameras(const Rig& rig);

/// Policy's response to the followed agent's state.
struct ReplayDecision {
  std::array<float, kNumActions> probabilities{};
  float value = 0;
};
/// logits: [kNumActions].
ReplayDecision decision_of(Span<const float> logits, float value);

ReplayBox replay_box(const AgentBox& box);

/// Throws Error if a replay of this size would exceed kMaxReplayNumbers.
void check_replay_room(int num_agents, int64_t num_steps);

/// Records one world. At RecorderOptions::max_numbers, prints a notice and ignores later frames.
class Recorder final : public StepObserver {
 public:
  /// The current state is the first frame. The simulator must outlive the recorder. Throws UsageError if the simulator
  /// does not use host memory, or the world or the followed agent does not exist.
  Recorder(Simulator& simulator, const RecorderOptions& options);
  ~Recorder() override;

  /// Records the response for the next step.
  void decide(const ReplayDecision& decision);
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  /// Begins an episode if this world is in the mask.
  void after_reset(Span<const uint8_t> world_mask = {}) override;

  /// Returns the recording so far, without images that are not yet compressed. The last frame is the current state.
  const Replay& recorded() const;
  /// Map, seed, world, step duration and light cycles come from the simulator, not from `origin`.
  void set_origin(ReplayOrigin origin);
  /// Keeps only the last frame. Metrics continue. Returns the slots whose agents entered in the discarded frames or in
  /// the last frame. Throws Error if the recorder follows an agent.
  std::vector<int32_t> discard_history();

  /// Returns the complete replay; ends the recorder's use. Each life (the time from an agent's entry to its exit) that
  /// began in the middle of an episode is a separate agent, after those of the slots. *agent_of_out: [frames, slots]
  /// index of each slot's agent.
  Replay finish(ReplayOrigin origin, std::vector<int32_t>* agent_of_out = nullptr);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
