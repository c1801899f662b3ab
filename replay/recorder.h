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
  int followed = -1;          // agent with decisions and images; -1: none
  RendererConfig cameras;     // for viewers
  bool keeps_images = false;  // drawn by the CPU renderer
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

/// Throws Error if a replay of this size would exceed kMaxReplayNumbers. Recorder::after_step() throws only once the
/// limit is reached.
void check_replay_room(int num_agents, int64_t num_steps);

/// Records one world.
class Recorder final : public StepObserver {
 public:
  /// The current state is the first frame. The simulator must outlive the recorder. Throws UsageError if the simulator
  /// does not use host memory, or the world or the followed agent does not exist.
  Recorder(Simulator& simulator, const RecorderOptions& options);
  ~Recorder() override;

  /// Records the response for the next step.
  void decide(const ReplayDecision& decision);
  void before_step(Span<const Command> commands) override;
  /// Throws Error if the replay would exceed kMaxReplayNumbers.
  void after_step(const StepResult& result) override;
  /// Begins an episode if this world is in the mask.
  void after_reset(Span<const uint8_t> world_mask = {}) override;

  /// Returns the recording so far, without images that are not yet compressed. The last frame is the current state.
  const Replay& recorded() const;
  /// Map, seed, world, step duration and light cycles come from the simulator, not from `origin`.
  void set_origin(ReplayOrigin origin);
  /// Keeps only the last frame. Metrics continue. Throws Error if the recorder follows an agent.
  void discard_history();

  /// Returns the complete replay; ends the recorder's use.
  Replay finish(ReplayOrigin origin);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
