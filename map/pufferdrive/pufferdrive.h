// Importer of PufferDrive's little-endian scenes: v1 (of 2025), v2 (of PufferDrive 2.0, with or without a leading
// scenario id) and v3c (of PufferDrive 3.0, and of 123Drive from version 0.3 on). The files do not state their version,
// so the importer takes the layout that uses exactly all bytes.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"

namespace pictura::pufferdrive {

/// Throws Error if no layout fits. For each layout, the message names the first field that does not fit.
LoggedScene parse_scene(std::string_view bytes, const std::string& source);

}  // namespace pictura::pufferdrive
