// Replays as MCAP files of JSON messages by Foxglove's schemas, for Foxglove and other readers of that format.
#pragma once

#include <string>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

/// Writes the file, completely or not at all; docs/reference/replay.md lists its topics. Time begins at 0. Throws Error
/// naming the path.
void write_mcap(const std::string& path, const Replay& replay);

}  // namespace pictura
