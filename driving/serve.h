// A live view of what a program simulates.
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

/// Serves the only world of a simulator in host memory, and says where on stderr. The simulator and what the driver
/// names must outlive it. Throws UsageError where this build cannot, Error where the port is taken.
std::unique_ptr<LiveView> serve(const ServeOptions& options, Simulator& simulator, const RecordedDriver& driver,
                                const RecordingOptions& recording);

/// Waits until the next step is due: for the first page, for whoever has paused it, and for its pace. False once the
/// process was asked to end.
bool await_step(LiveView& view);

}  // namespace pictura
