// Lossless images of a replay. Most pixels equal the pixel to their left, above them, or in the previous image; most
// others have one of a few hues at some brightness. An adaptive arithmetic coder encodes which case holds, as
// docs/reference/replay.md defines. Each group of frames is decoded on its own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

constexpr int kReplayFramesPerGroup = 25;

/// Colours of primitives before they fade.
std::vector<ReplayHue> replay_hues();

/// Colour in bytes.
ReplayHue replay_hue(Rgb color);

/// Bytes of a frame: [height, width, 3] for each camera, one after the other.
size_t bytes_of_frame(const std::vector<ReplayCamera>& cameras);

/// Compresses one or more complete frames.
std::string pack_images(const std::vector<ReplayCamera>& cameras, std::string_view frames);

/// Decompresses the `count` frames of a group. Throws Error if the group is damaged.
std::string unpack_images(const std::vector<ReplayCamera>& cameras, std::string_view group, int count);

}  // namespace pictura
