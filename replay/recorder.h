// Records one world of a simulator, in host memory, step by step.
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
  int followed = -1;          // agent of the world whose decisions and images are kept, or -1
  RendererConfig cameras;     // of every agent, for whom looks at the replay
  bool keeps_images = false;  // of the followed agent, drawn by the CPU renderer
};

/// Draws what one agent sees, by the CPU renderer.
class AgentCameras {
 public:
  /// `config` as a policy's, whatever device and samples it names. The simulator must outlive it.
  AgentCameras(Simulator& simulator, RendererConfig config);
  ~AgentCameras();

  /// [height, width, 3] of each camera, one after the other, of a slot's view now.
  std::string draw(int slot);

 private:
  Simulator& simulator_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<HostImages> images_;
};

/// Cameras as replays hold them.
std::vector<ReplayCamera> replay_cameras(const Rig& rig);

/// What a policy makes of the followed agent's state.
struct ReplayDecision {
  std::array<float, kNumActions> probabilities{};
  float value = 0;
};
/// From a policy's logits [kNumActions].
ReplayDecision decision_of(Span<const float> logits, float value);

/// A box in a replay's units.
ReplayBox replay_box(const AgentBox& box);

/// Throws Error where a replay of so many agents and steps would hold more numbers than one may: at the door, what
/// Recorder::after_step() throws at last.
void check_replay_room(int num_agents, int64_t num_steps);

/// Throws UsageError where the simulator does not work in host memory, or has no such world or agent.
class Recorder final : public StepObserver {
 public:
  /// The state of the simulator, which must outlive the recorder, is the first frame.
  Recorder(Simulator& simulator, const RecorderOptions& options);
  ~Recorder() override;

  /// What the followed agent's policy makes of its state, for the next step.
  void decide(const ReplayDecision& decision);
  void before_step(Span<const Command> commands) override;
  /// Throws Error where the replay would take more memory than it may.
  void after_step(const StepResult& result) override;
  /// A new episode begins if this recorder's world is among them.
  void after_reset(Span<const uint8_t> world_mask = {}) override;

  /// What was recorded until now, without images that wait to be compressed; its last frame is the simulator's state.
  const Replay& recorded() const;
  /// Of `origin`, what the simulator knows (map, seed, world, pace) is filled in.
  void set_origin(ReplayOrigin origin);
  /// Keeps nothing but the last frame, as the first of a replay, and the metrics of all. Not with a followed agent.
  void forget();

  /// All of it, with this origin. The recorder is spent.
  Replay finish(ReplayOrigin origin);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
