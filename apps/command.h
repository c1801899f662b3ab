// Entry point of `pictura` for main() and tests. It converts exceptions to one-line messages and exit statuses: 0
// success, 1 failure, 2 wrong usage, 130 after ^C, 143 after SIGTERM, 129 after SIGHUP.
#pragma once

namespace pictura {

/// Sets signal handlers, closes stdout, and returns the exit status.
int run_command(int argc, char** argv);

}  // namespace pictura
