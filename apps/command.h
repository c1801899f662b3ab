// Entry point of the `pictura` command for main() and tests: subcommands, exit statuses (0 success, 1 failure, 2 wrong
// usage, 130 after ^C, 143 after SIGTERM, 129 after a hang-up) and one-line error messages.
#pragma once

namespace pictura {

/// Runs a command line as a separate process would: sets signal handlers and closes stdout. Returns the exit status.
int run_command(int argc, char** argv);

}  // namespace pictura
