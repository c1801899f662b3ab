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
          "Let a browser watch, pause, step and drive: prints the page's address, reachable only from this machine. "
          "The simulation begins when a page opens, runs in real time, and without --steps runs until ^C. Default "
          "port: a free one")
      ->type_name("[PORT]")
      ->expected(0, 1);
  command->add_option("--serve-host", options_out->host_name,
                      "With --serve: listen on all of this machine's addresses, for pages that use this host name. "
                      "Anyone with the address can then drive; nothing is encrypted");
}

}  // namespace pictura
