// Live view of a running simulation.
#pragma once

#include <memory>
#include <string>

#include "pictura/driving/recording.h"
#include "pictura/replay/live_view.h"

namespace pictura {

struct ServeOptions {
  bool is_asked = false;
  int port = 0;
  std::string host_name;
};

/// Serves the only world of a simulator in host memory, and reports the URL on stderr. The simulator and the driver's
/// objects must outlive the view. Throws UsageError if this build lacks the server, and Error if the port is in use.
std::unique_ptr<LiveView> serve(const ServeOptions& options, Simulator& simulator, const RecordedDriver& driver,
                                const RecordingOptions& recording);

/// Waits until the next step is due: a page has been opened, no page pauses, and the pace allows the step. Returns
/// false after an interrupt.
bool await_step(LiveView& view);

}  // namespace pictura
