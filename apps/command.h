// The `pictura` command, which main() and tests call: subcommands, exit statuses (0 success, 1 failure, 2 wrong usage,
// 130 after ^C, 143 after SIGTERM, 129 after a hang-up) and one-line error messages.
#pragma once

namespace pictura {

/// Does what the words say, as a process of its own: sets what signals do and closes stdout. Returns the exit status.
int run_command(int argc, char** argv);

}  // namespace pictura
