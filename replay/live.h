// Messages between a running world and the browser pages that show it: the world's state, and the requests of viewers.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "pictura/common/error_types.h"
#include "pictura/replay/recorder.h"
#include "pictura/simulator/controllers/keyboard.h"

namespace pictura {

using LiveJson = nlohmann::ordered_json;

/// Observes the only world of a simulator in host memory, and keeps only the world's newest frame.
class LiveWorld final : public StepObserver {
 public:
  /// The simulator must outlive this object.
  LiveWorld(Simulator& simulator, ReplayOrigin origin, const RendererConfig& cameras, bool sends_images);

  void before_step(Span<const Command> commands) override { recorder_.before_step(commands); }
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;

  /// Returns a message with all data that a page needs to begin at this frame.
  LiveJson begin() const;
  /// Returns a message with the newest frame, for pages that have the previous frame.
  LiveJson frame() const;
  LiveJson agent_message(const std::optional<ReplayDecision>& decision, int agent);

  int num_agents() const { return recorder_.recorded().num_agents; }
  int64_t step() const { return step_; }

 private:
  /// Discards all frames of the recording except the newest. `num_episodes` is the number of episodes in the recording
  /// before that frame was added.
  void keep_newest(size_t num_episodes);

  Recorder recorder_;
  std::unique_ptr<AgentCameras> cameras_;
  int64_t step_ = 0;
  bool begins_episode_ = false;
};

/// Request of a page. Members without a value change nothing.
struct LiveRequest {
  std::optional<bool> paused;
  std::optional<int> steps;  // steps to take while paused
  std::optional<double> pace;
  std::optional<int> watched;  // agent whose images and decisions are sent
  std::optional<int> driven;   // agent that the viewer drives by keys, or -1
  std::optional<DrivingKeys> keys;
};

constexpr int kMaxLiveSteps = 1000;
constexpr double kMinLivePace = 0.05, kMaxLivePace = 64;

/// Parses {"paused": bool, "steps": 1 to kMaxLiveSteps, "pace": number, "watch": agent, "drive": agent or -1, "keys":
/// ["forward", "backward", "stop", "left", "right"]}. Throws Error, which names the member, if a member is invalid.
LiveRequest parse_live_request(std::string_view text, int num_agents);

}  // namespace pictura
