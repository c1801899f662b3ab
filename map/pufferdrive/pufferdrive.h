// Importer of PufferDrive's binary scenes. Their layouts have no magic number or version, so the importer tries each
// layout and takes the one that fits the file to the last byte. Supported layouts are v1 (of 2025), v2 (of PufferDrive
// 2.0, with or without a leading scenario id) and v3c (of PufferDrive 3.0, and of 123Drive from version 0.3 on). All
// are little-endian.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"

namespace pictura::pufferdrive {

/// Parses the bytes of a scene file. Throws Error if no layout fits. The message names the source and, for each layout,
/// the first field that does not fit.
LoggedScene parse_scene(std::string_view bytes, const std::string& source);

}  // namespace pictura::pufferdrive
