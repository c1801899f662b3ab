// Replays as files: one self-contained HTML page, which can be read back.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

/// Maximum number of image bytes in a page; images of later frames are omitted, and the page draws them itself. In
/// base64 these are 10 MB.
constexpr size_t kMaxWrittenImageBytes = 7'500'000;

/// Writes the page, completely or not at all. Throws Error naming the path.
void write_replay(const std::string& path, const Replay& replay);

/// A replay as live pages receive it (docs/reference/replay.md): its header, and the bytes of the sections that the
/// header lists, as base64 of a zlib stream.
struct ReplayText {
  nlohmann::ordered_json header;
  std::string data;
};
ReplayText replay_text(const Replay& replay);

/// Reads a page written by write_replay(). Throws Error naming the path and what is damaged or missing.
Replay read_replay(const std::string& path);

/// Reads only the header of a page: origin, metrics and sizes, see docs/reference/replay.md. Throws as read_replay()
/// does.
nlohmann::ordered_json read_replay_header(const std::string& path);

}  // namespace pictura
