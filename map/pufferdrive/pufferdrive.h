// PufferDrive's binary scenes. No layout has a magic number or a version: a file has the one layout that it fits to the
// last byte. Supported layouts are v1 (2025), v2 (2.0, with or without a leading scenario id) and v3c (3.0; 123Drive
// from version 0.3 on), little-endian.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"

namespace pictura::pufferdrive {

/// Parses the bytes of a scene file. Throws Error naming the source and, for each tried layout, the first field that
/// does not fit.
LoggedScene parse_scene(std::string_view bytes, const std::string& source);

}  // namespace pictura::pufferdrive
