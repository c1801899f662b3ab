// Records one world of a simulator, in host memory, step by step.
#pragma once

#include <memory>
#include <optional>

#include "pictura/common/renderer.h"
#include "pictura/replay/replay.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct RecorderOptions {
  int world = 0;
  int followed = -1;                      // agent of the world whose decisions and images are kept, or -1
  std::optional<RendererConfig> cameras;  // what its images are drawn with, by the CPU renderer; nothing: no images
};

/// What a policy makes of the followed agent's state.
struct ReplayDecision {
  std::array<float, kNumActions> probabilities{};
  float value = 0;
};
/// From a policy's logits [kNumActions].
ReplayDecision decision_of(Span<const float> logits, float value);

/// Throws UsageError where the simulator does not work in host memory, or has no such world or agent.
class Recorder {
 public:
  /// The state of the simulator, which must outlive the recorder, is the first frame.
  Recorder(Simulator& simulator, const RecorderOptions& options);
  ~Recorder();

  /// Before each step: its commands [slots], and, where the followed agent's policy was asked, its decision.
  void before_step(Span<const Command> commands, const std::optional<ReplayDecision>& decision = {});
  /// After it. Throws Error where the replay would take more memory than it may.
  void after_step(const StepResult& result);

  /// All of it. Of `origin`, what the simulator knows (map, seed, world, pace) is filled in. The recorder is spent.
  Replay finish(ReplayOrigin origin);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
