// Messages between a running world and browser pages.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pictura/common/error_types.h"
#include "pictura/replay/recorder.h"
#include "pictura/simulator/controllers/keyboard.h"

namespace pictura {

using LiveJson = nlohmann::ordered_json;

/// Newest frame of the only world of a simulator in host memory.
class LiveWorld final : public StepObserver {
 public:
  /// The simulator must outlive this object.
  LiveWorld(Simulator& simulator, ReplayOrigin origin, const RendererConfig& cameras, bool sends_images);

  void before_step(Span<const Command> commands) override { recorder_.before_step(commands); }
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;

  /// Returns all data for a page to begin at this frame.
  LiveJson begin() const;
  /// Returns the newest frame for pages that have the previous one.
  LiveJson frame() const;
  LiveJson agent_message(const std::optional<ReplayDecision>& decision, int agent);

  int num_agents() const { return recorder_.recorded().num_agents; }
  int64_t step() const { return step_; }

 private:
  /// Keeps only the newest frame. `num_episodes`: the number of episodes before the frame was added.
  void keep_newest(size_t num_episodes);

  Recorder recorder_;
  std::unique_ptr<AgentCameras> cameras_;
  int64_t step_ = 0;
  bool begins_episode_ = false;
  std::vector<int32_t> entered_;  // agents that entered in the newest frame
};

/// Request of a page; empty members change nothing.
struct LiveRequest {
  std::optional<bool> paused;
  std::optional<int> steps;  // while paused
  std::optional<double> pace;
  std::optional<int> watched;  // agent whose images and decisions are sent
  std::optional<int> driven;   // agent that the viewer's keys drive, or -1
  std::optional<DrivingKeys> keys;
};

constexpr int kMaxLiveSteps = 1000;
constexpr double kMinLivePace = 0.05, kMaxLivePace = 64;

/// Parses {"paused": bool, "steps": 1 to kMaxLiveSteps, "pace": number, "watch": agent, "drive": agent or -1, "keys":
/// ["forward", "backward", "stop", "left", "right"]}. Throws Error naming an invalid member.
LiveRequest parse_live_request(std::string_view text, int num_agents);

}  // namespace pictura
