// Images as patches: the layout that a first convolution over patches reads. Shared by both devices and by kernels that
// are compiled at run time.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Default side of patches in a request for images.
constexpr int kDefaultPatch_px = 4;
/// Whether renderers write patches of this side: 4, 8, 12 or 16 px. A thread of a kernel writes four neighbouring
/// pixels at once, which never cross an edge of such a patch.
PICTURA_HD constexpr bool is_drawn_patch(int patch_px) { return patch_px > 0 && patch_px <= 16 && patch_px % 4 == 0; }

/// Number of values of a patch: three channels of its pixels.
PICTURA_HD constexpr int patch_values(int patch_px) { return 3 * patch_px * patch_px; }

/// Number of patches along a side of size_px pixels; the last patch may extend beyond the image.
PICTURA_HD constexpr int patches_along(int patch_px, int size_px) { return (size_px + patch_px - 1) / patch_px; }

/// Index of a channel of pixel (x, y) in an image of this width, stored as [rows, columns, patch_values(patch_px)].
/// Within a patch, value (channel * patch_px + y) * patch_px + x is that channel of the patch's pixel (x, y).
PICTURA_HD constexpr int64_t place_in_patches(int patch_px, int width_px, int channel, int x, int y) {
  const int64_t patch = static_cast<int64_t>(y / patch_px) * patches_along(patch_px, width_px) + x / patch_px;
  return patch * patch_values(patch_px) + (channel * patch_px + y % patch_px) * patch_px + x % patch_px;
}

}  // namespace pictura
