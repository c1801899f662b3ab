// Entry point of the `pictura` command for main() and tests. It adds subcommands, and converts exceptions to one-line
// error messages and exit statuses: 0 success, 1 failure, 2 wrong usage, 130 after ^C, 143 after SIGTERM, 129 after
// SIGHUP.
#pragma once

namespace pictura {

/// Runs a command line like a separate process: sets signal handlers and closes stdout. Returns the exit status.
int run_command(int argc, char** argv);

}  // namespace pictura
