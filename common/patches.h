// Layout of an image as square patches, for networks with a convolution over patches.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

constexpr int kDefaultPatch_px = 4;
/// Whether renderers can write patches with sides of patch_px. The side must be a multiple of 4, because a kernel's
/// thread writes four neighbouring pixels of one patch.
PICTURA_HD constexpr bool is_drawn_patch(int patch_px) { return patch_px > 0 && patch_px <= 16 && patch_px % 4 == 0; }

PICTURA_HD constexpr int patch_values(int patch_px) { return 3 * patch_px * patch_px; }

/// Number of patches along a side of size_px pixels. The last patch may extend beyond the image.
PICTURA_HD constexpr int patches_along(int patch_px, int size_px) { return (size_px + patch_px - 1) / patch_px; }

/// Index of a value in an image [rows of patches, columns of patches, patch_values(patch_px)]. The values of a patch
/// are ordered [channel, y, x].
PICTURA_HD constexpr int64_t place_in_patches(int patch_px, int width_px, int channel, int x, int y) {
  const int64_t patch = static_cast<int64_t>(y / patch_px) * patches_along(patch_px, width_px) + x / patch_px;
  return patch * patch_values(patch_px) + (channel * patch_px + y % patch_px) * patch_px + x % patch_px;
}

}  // namespace pictura
