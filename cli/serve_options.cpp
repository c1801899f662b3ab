#include "pictura/cli/serve_options.h"

#include <optional>

#include "pictura/common/error.h"
#include "pictura/common/support/numbers.h"

namespace pictura {

namespace {

/// Whether CLI11 passes this text for an option without a value. Versions of CLI11 differ.
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
          "Show a live page in the browser, which can pause and step the simulation and drive an agent. Prints the "
          "page's address, which is reachable only from this machine. The simulation begins when a page opens, and "
          "runs in real time. Without --steps it runs until ^C. Default port: a free one")
      ->type_name("[PORT]")
      ->expected(0, 1);
  command->add_option("--serve-host", options_out->host_name,
                      "With --serve: listen on all network interfaces, for browsers that reach this machine by this "
                      "host name. Every person with the page's address can then drive; nothing is encrypted");
}

}  // namespace pictura
