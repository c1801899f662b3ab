// Replays as MCAP files with JSON messages in Foxglove's schemas.
#pragma once

#include <string>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

/// Writes the complete file or nothing, see docs/reference/replay.md. Times begin at 0. Throws Error naming the path.
void write_mcap(const std::string& path, const Replay& replay);

}  // namespace pictura
