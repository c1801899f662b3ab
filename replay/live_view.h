// A world that pages in a browser watch, pause, step and drive in while it runs: what they ask is done, and the next
// step is due in its time.
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
  std::string host_name;       // if set: listens on all addresses, for pages that name this machine so
  int watched = 0;             // the agent whose decisions and images pages get first
  RendererConfig cameras;      // of every agent
  bool sends_images = false;   // of the watched agent, drawn here; else pages draw them themselves
  bool waits_for_page = true;  // no step is due before a page has come
};

class LiveView final : public StepObserver {
 public:
  /// What drives the agent would do now, where it is a policy.
  using Decide = std::function<std::optional<ReplayDecision>(int agent)>;

  /// Serves the only world of a simulator in host memory, which must outlive it. Throws UsageError where this build
  /// cannot or there is no such agent, Error where the port is taken.
  LiveView(Simulator& simulator, const LiveViewOptions& options, const ReplayOrigin& origin, Decide decide);
  ~LiveView() override;

  /// Of the page, with its secret.
  const std::string& address() const;
  int num_pages() const;

  /// Does what pages ask and waits, 50 ms at most, until the next step is due.
  bool is_due() override;
  /// Puts what a person's keys ask for among the commands [slots].
  void override_commands(Span<Command> commands_inout) override;
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  void after_reset(Span<const uint8_t> world_mask) override;
  /// Tells pages that it is over; they keep what they have seen.
  void finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
