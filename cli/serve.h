// `--serve`: a world that pages in a browser watch, pause, step and drive in while it runs.
#pragma once

#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "pictura/cli/record.h"

namespace pictura {

struct ServeOptions {
  bool is_asked = false;
  int port = 0;
  std::string host_name;
};

/// Adds --serve and --serve-host.
void add_serve_options(CLI::App* command, ServeOptions* options_out);

class Serving {
 public:
  /// Serves the only world of a simulator in host memory, and says where on stderr. The simulator and what the driver
  /// names must outlive it. Throws UsageError where this build cannot, Error where the port is taken.
  Serving(const ServeOptions& options, Simulator& simulator, const RecordedDriver& driver,
          const RecordingOptions& recording);
  ~Serving();

  /// Waits until the next step is due: for the first page, for whoever has paused it, and for its pace. False once the
  /// process was asked to end.
  bool await_step();
  /// Before each step: puts what a person's keys ask for among the commands [slots].
  void before_step(Span<Command> commands_inout);
  /// After it.
  void after_step(const StepResult& result);
  /// Tells pages that it is over; they keep what they have seen.
  void finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
