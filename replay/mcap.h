// Writes replays as MCAP files, for Foxglove and other readers of that format. Messages are JSON with Foxglove's
// schemas.
#pragma once

#include <string>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

/// Writes the file, completely or not at all. docs/reference/replay.md lists its topics. Times begin at 0. Throws
/// Error, which names the path, if the file cannot be written.
void write_mcap(const std::string& path, const Replay& replay);

}  // namespace pictura
