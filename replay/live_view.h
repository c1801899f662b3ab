// Live view of a running world. Pages in a browser watch the world, pause it, step it, and drive an agent. The view
// executes their requests, and paces the steps.
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
  // If set, the view listens on all addresses, and accepts requests to this name of the machine.
  std::string host_name;
  int watched = 0;             // agent whose decisions and images pages receive at first
  RendererConfig cameras;      // cameras of every agent
  bool sends_images = false;   // sends images of the watched agent; else pages draw them
  bool waits_for_page = true;  // the first step waits for the first page
};

class LiveView final : public StepObserver {
 public:
  /// Function that returns the policy's response to the agent's current state, or nothing if no policy drives the
  /// agent.
  using Decide = std::function<std::optional<ReplayDecision>(int agent)>;

  /// Serves the only world of a simulator in host memory. The simulator must outlive the view. Throws UsageError if
  /// this build lacks the server, or if the watched agent does not exist, and Error if the port is in use.
  LiveView(Simulator& simulator, const LiveViewOptions& options, const ReplayOrigin& origin, Decide decide);
  ~LiveView() override;

  /// Returns the URL of the page, which contains a secret.
  const std::string& address() const;
  int num_pages() const;

  /// Executes the pages' requests, then waits for at most 50 ms until the next step is due. Returns whether it is due.
  bool is_due() override;
  /// If a viewer drives an agent, sets this agent's command from the pressed keys. The commands are [slots].
  void override_commands(Span<Command> commands_inout) override;
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  /// Notifies pages that the simulation has ended. The pages keep the frames that they have received.
  void finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
