// The images of a replay, without loss. A pixel is mostly that to its left, above it, or in the image before; where it
// is none of them, its colour is mostly one of few hues at some brightness. Which of it holds is written by an adaptive
// arithmetic coder, as docs/reference/replay.md defines it. A group of frames needs no other to be read.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

constexpr int kReplayFramesPerGroup = 25;

/// The colours that primitives have before they fade.
std::vector<ReplayHue> replay_hues();

/// A colour in bytes.
ReplayHue replay_hue(Rgb color);

/// Bytes of a frame: [height, width, 3] of each camera, one after the other.
size_t bytes_of_frame(const std::vector<ReplayCamera>& cameras);

/// Compresses whole frames, one after the other, of at least one.
std::string pack_images(const std::vector<ReplayCamera>& cameras, std::string_view frames);

/// The `count` frames of a group. Throws Error where it is damaged.
std::string unpack_images(const std::vector<ReplayCamera>& cameras, std::string_view group, int count);

}  // namespace pictura
