// Replays as self-contained HTML pages.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

/// Maximum bytes of compressed images in a page. Frames beyond this limit have no stored images; the page draws them in
/// the browser.
constexpr size_t kMaxWrittenImageBytes = 7'500'000;

/// Writes the complete page or nothing. Throws Error naming the path.
void write_replay(const std::string& path, const Replay& replay);

/// Replay as live pages receive it (docs/reference/replay.md): the header, and its sections as base64 of a zlib stream.
struct ReplayText {
  nlohmann::ordered_json header;
  std::string data;
};
ReplayText replay_text(const Replay& replay);

/// Throws Error naming the path and the fault if the page is damaged.
Replay read_replay(const std::string& path);

/// Reads only the header. Throws as read_replay() does.
nlohmann::ordered_json read_replay_header(const std::string& path);

}  // namespace pictura
