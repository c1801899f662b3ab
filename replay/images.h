// The images of a replay, without loss: each row of an image by what is nearest to it of the pixels before, above, and
// in the image before, and all rows of a group of frames as one zlib stream. A group needs no other to be read.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/replay/replay.h"

namespace pictura {

constexpr int kReplayFramesPerGroup = 40;

/// Bytes of a frame: [height, width, 3] of each camera, one after the other.
size_t bytes_of_frame(const std::vector<ReplayCamera>& cameras);

/// Compresses whole frames, one after the other, of at least one.
std::string pack_images(const std::vector<ReplayCamera>& cameras, std::string_view frames);

/// The `count` frames of a group. Throws Error where it is damaged.
std::string unpack_images(const std::vector<ReplayCamera>& cameras, std::string_view group, int count);

}  // namespace pictura
