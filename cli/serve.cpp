#include "pictura/cli/serve.h"

#include <chrono>
#include <optional>

#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/numbers.h"

namespace pictura {

namespace {

/// What CLI11 gives for an option without its value, by its version.
bool is_no_port(const std::string& text) { return text.empty() || text == "true"; }

}  // namespace

void add_serve_options(CLI::App* command, ServeOptions* options_out) {
  command
      ->add_option_function<std::string>(
          "--serve",
          [options_out](const std::string& text) {
            options_out->is_asked = true;
            if (is_no_port(text)) return;
            const std::optional<uint64_t> port = parse_unsigned(text);
            if (!port || *port < 1 || *port > 65535)
              fail_usage("--serve: expected a port of 1 to 65535, got '{}'", text);
            options_out->port = static_cast<int>(*port);
          },
          "Let a browser watch, pause, step and drive: prints the page's address, on this machine alone. It begins "
          "when a page opens, runs in real time, and without --steps goes on until ^C. Default port: a free one")
      ->type_name("[PORT]")
      ->expected(0, 1);
  command->add_option("--serve-host", options_out->host_name,
                      "With --serve: listen on all of this machine's addresses, for pages that name it so. Whoever "
                      "has the address can then drive; nothing is encrypted");
}

std::unique_ptr<LiveView> serve(const ServeOptions& options, Simulator& simulator, const RecordedDriver& driver,
                                const RecordingOptions& recording) {
  const LiveViewOptions view{.port = options.port,
                             .host_name = options.host_name,
                             .watched = recording.followed.value_or(0),
                             .cameras = cameras_of(driver),
                             .sends_images = recording.cameras};
  auto serving = std::make_unique<LiveView>(simulator, view, origin_of(driver), [&simulator, driver](int agent) {
    return decision_of_agent(simulator, driver, agent);
  });
  // A page opens with the agent that its address names.
  const std::string opens_with = recording.followed ? fmt::format("#agent={}", *recording.followed) : "";
  print_message("serving {}{} (^C ends it)\n", serving->address(), opens_with);
  return serving;
}

bool await_step(LiveView& view) {
  constexpr std::chrono::milliseconds kGlance{50};  // between two looks at whether to end
  while (!interrupted()) {
    if (view.is_due(kGlance)) return true;
  }
  return false;
}

}  // namespace pictura
