// Live view of a running world, in which pages in a browser watch, pause, step and drive. It executes their requests
// and paces the steps.
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
  int port = 0;                // 0: a free one
  std::string host_name;       // if set: listens on all addresses, for pages that address this machine by this name
  int watched = 0;             // initial agent whose decisions and images pages get
  RendererConfig cameras;      // cameras of every agent
  bool sends_images = false;   // images of the watched agent, drawn here; else pages draw them
  bool waits_for_page = true;  // waits for the first page before the first step
};

class LiveView final : public StepObserver {
 public:
  /// Returns the present response of the agent's policy; empty for other controllers.
  using Decide = std::function<std::optional<ReplayDecision>(int agent)>;

  /// Serves the only world of a simulator in host memory, which must outlive the view. Throws UsageError if this build
  /// lacks the server or the agent does not exist, Error if the port is in use.
  LiveView(Simulator& simulator, const LiveViewOptions& options, const ReplayOrigin& origin, Decide decide);
  ~LiveView() override;

  /// Address of the page, including its secret.
  const std::string& address() const;
  int num_pages() const;

  /// Executes the pages' requests and waits, for at most 50 ms, until the next step is due.
  bool is_due() override;
  /// Replaces the command of the agent that a viewer drives by keys, in commands [slots].
  void override_commands(Span<Command> commands_inout) override;
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  /// Tells pages that the simulation has ended; they keep what they have received.
  void finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
