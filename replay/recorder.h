// Records one world of a simulator that uses host memory, step by step.
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
  int followed = -1;          // agent whose decisions and images are recorded, or -1
  RendererConfig cameras;     // cameras of every agent, for viewers of the replay
  bool keeps_images = false;  // records images of the followed agent, drawn by the CPU renderer
};

/// Draws one agent's images with the CPU renderer.
class AgentCameras {
 public:
  /// Creates a renderer with this configuration, but on the host and with exact coverage. The simulator must outlive
  /// this object.
  AgentCameras(Simulator& simulator, RendererConfig config);
  ~AgentCameras();

  /// Draws the current view of a slot's agent. Returns [height, width, 3] bytes for each camera, one camera after the
  /// other.
  std::string draw(int slot);

 private:
  Simulator& simulator_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<HostImages> images_;
};

/// Returns the cameras in the form of replays.
std::vector<ReplayCamera> replay_cameras(const Rig& rig);

/// Response of a policy to the followed agent's state.
struct ReplayDecision {
  std::array<float, kNumActions> probabilities{};
  float value = 0;
};
/// Returns the response of a policy with these logits [kNumActions] and this value.
ReplayDecision decision_of(Span<const float> logits, float value);

/// Returns a box in a replay's units.
ReplayBox replay_box(const AgentBox& box);

/// Throws Error if a replay of this number of agents and steps would exceed the limit kMaxReplayNumbers. This is an
/// early check for the error that Recorder::after_step() throws.
void check_replay_room(int num_agents, int64_t num_steps);

/// Recorder of one world. The constructor throws UsageError if the simulator does not use host memory, or if the world
/// or the followed agent does not exist.
class Recorder final : public StepObserver {
 public:
  /// Starts recording. The simulator's current state is the first frame. The simulator must outlive the recorder.
  Recorder(Simulator& simulator, const RecorderOptions& options);
  ~Recorder() override;

  /// Records the followed agent's response for the next step.
  void decide(const ReplayDecision& decision);
  void before_step(Span<const Command> commands) override;
  /// Throws Error if the replay would exceed its memory limit.
  void after_step(const StepResult& result) override;
  /// Begins an episode if this recorder's world is in the mask.
  void after_reset(Span<const uint8_t> world_mask = {}) override;

  /// Returns the recording so far, without images that are not yet compressed. The last frame is the simulator's
  /// current state.
  const Replay& recorded() const;
  /// Sets the origin of the replay. Its map, seed, world, step duration and light cycles are taken from the simulator,
  /// not from `origin`.
  void set_origin(ReplayOrigin origin);
  /// Discards all frames except the last, which becomes the first frame of the recording. Metrics continue. Throws
  /// Error if the recorder follows an agent.
  void discard_history();

  /// Returns the complete replay, with this origin. The recorder cannot be used afterwards.
  Replay finish(ReplayOrigin origin);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
