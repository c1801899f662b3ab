// Options of live views.
#pragma once

#include <CLI/CLI.hpp>

#include "pictura/driving/serve.h"

namespace pictura {

/// Adds --serve and --serve-host.
void add_serve_options(CLI::App* command, ServeOptions* options_out);

}  // namespace pictura
