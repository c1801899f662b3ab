// Lossless compression of a replay's images. Most pixels equal the pixel to their left, above them, or in the previous
// image. Most other pixels have one of a few hues at some brightness. An adaptive arithmetic coder encodes which case
// applies to each pixel; docs/reference/replay.md defines the format. Each group of frames can be decoded separately.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

constexpr int kReplayFramesPerGroup = 25;

/// Returns the colours of drawn primitives before distance fades them.
std::vector<ReplayHue> replay_hues();

/// Returns a colour in bytes.
ReplayHue replay_hue(Rgb color);

/// Returns the size of a frame in bytes. A frame is [height, width, 3] for each camera, one camera after the other.
size_t bytes_of_frame(const std::vector<ReplayCamera>& cameras);

/// Compresses one or more complete frames.
std::string pack_images(const std::vector<ReplayCamera>& cameras, std::string_view frames);

/// Decompresses the `count` frames of a group. Throws Error if the group is damaged.
std::string unpack_images(const std::vector<ReplayCamera>& cameras, std::string_view group, int count);

}  // namespace pictura
