// Replays as files: self-contained HTML pages, which can be read back.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

/// Maximum number of bytes of compressed images in a page (10 MB in base64). Images of later frames are omitted, and
/// the page draws these frames itself.
constexpr size_t kMaxWrittenImageBytes = 7'500'000;

/// Writes the page, completely or not at all. Throws Error, which names the path, if it cannot be written.
void write_replay(const std::string& path, const Replay& replay);

/// A replay in the form in which live pages receive it (docs/reference/replay.md): its header, and `data`. `data`
/// contains the sections that the header lists, as base64 of a zlib stream.
struct ReplayText {
  nlohmann::ordered_json header;
  std::string data;
};
ReplayText replay_text(const Replay& replay);

/// Reads a page that write_replay() wrote. Throws Error, which names the path and the fault, if the page is damaged.
Replay read_replay(const std::string& path);

/// Reads only the header of a page: origin, metrics and sizes (docs/reference/replay.md). Throws as read_replay() does.
nlohmann::ordered_json read_replay_header(const std::string& path);

}  // namespace pictura
