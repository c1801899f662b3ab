// Images as patches: the layout that a first convolution over patches reads. Shared by both devices, and by kernels
// that are compiled at run time.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// The side of a patch of ChannelOrder::patches, and how many values one has: three channels of its pixels.
constexpr int kPatch_px = 4;
constexpr int kPatchValues = 3 * kPatch_px * kPatch_px;

/// Patches along a side of so many pixels; the last one may reach beyond the image.
PICTURA_HD constexpr int patches_along(int size_px) { return (size_px + kPatch_px - 1) / kPatch_px; }

/// Where a channel of a pixel lies in an image of this width: [rows, columns, kPatchValues], where value
/// (channel * kPatch_px + y) * kPatch_px + x of a patch is the channel of pixel (x, y) of the patch.
PICTURA_HD constexpr int64_t place_in_patches(int width_px, int channel, int x, int y) {
  const int64_t patch = static_cast<int64_t>(y / kPatch_px) * patches_along(width_px) + x / kPatch_px;
  return patch * kPatchValues + (channel * kPatch_px + y % kPatch_px) * kPatch_px + x % kPatch_px;
}

}  // namespace pictura
