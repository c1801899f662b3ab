// Lossless compression of a replay's images with an adaptive arithmetic coder; docs/reference/replay.md defines the
// format. Each group of frames can be decoded separately.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/replay/replay.h"

namespace pictura {

constexpr int kReplayFramesPerGroup = 25;

/// Returns the colours of primitives before distance fades them.
std::vector<ReplayHue> replay_hues();

ReplayHue replay_hue(Rgb color);

/// Returns the size of a frame: [height, width, 3] bytes per camera.
size_t bytes_of_frame(const std::vector<ReplayCamera>& cameras);

std::string pack_images(const std::vector<ReplayCamera>& cameras, std::string_view frames);

/// Throws Error if the group is damaged.
std::string unpack_images(const std::vector<ReplayCamera>& cameras, std::string_view group, int count);

}  // namespace pictura
