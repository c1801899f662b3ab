// Replays as files: one HTML page that holds everything, and is read back from.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

/// Of a page's images: those of later frames are left out, and the page draws them itself. In base64 they are 10 MB.
constexpr size_t kMaxWrittenImageBytes = 7'500'000;

/// Writes the page, whole or not at all. Throws Error naming the path.
void write_replay(const std::string& path, const Replay& replay);

/// The header, and the bytes of the section that it lists, in base64 of a zlib stream: what a page that is told of a
/// replay reads (docs/reference/replay.md).
struct ReplayText {
  nlohmann::ordered_json header;
  std::string data;
};
ReplayText replay_text(const Replay& replay);

/// Reads what write_replay() wrote. Throws Error naming the path and what is damaged or missing.
Replay read_replay(const std::string& path);

/// What stands in a page before its numbers: origin, metrics and sizes, see docs/reference/replay.md. Throws as
/// read_replay().
nlohmann::ordered_json read_replay_header(const std::string& path);

}  // namespace pictura
