// Live view of a running world, which browser pages watch, pause, step, and drive.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/renderer.h"
#include "pictura/replay/recorder.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

struct LiveViewOptions {
  int port = 0;  // 0: any free port
  // If set, listens on all addresses, and accepts requests to this host name.
  std::string host_name;
  int watched = 0;             // agent whose decisions and images are sent first; pages may choose another
  RendererConfig cameras;      // cameras of every agent
  bool sends_images = false;   // else pages draw images
  bool waits_for_page = true;  // the first step waits for a page
};

class LiveView final : public StepObserver {
 public:
  /// Returns the policy's response to the agent's state, or nothing without a policy.
  using Decide = std::function<std::optional<ReplayDecision>(int agent)>;

  /// Serves the only world of a simulator in host memory, which must outlive the view. Throws UsageError if this build
  /// lacks the server or the watched agent does not exist, and Error if the port is in use.
  LiveView(Simulator& simulator, const LiveViewOptions& options, const ReplayOrigin& origin, Decide decide);
  ~LiveView() override;

  /// Returns the page's URL, which contains a secret.
  const std::string& address() const;
  int num_pages() const;

  /// Executes the pages' requests, then waits up to 50 ms for the next step. Returns whether it is due.
  bool is_due() override;
  /// Sets the command of an agent that a viewer drives. commands_inout: [slots].
  void override_commands(Span<Command> commands_inout) override;
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  void finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
