// PufferDrive's binary scenes. No layout has a magic number or a version: a file is of the one layout that it fits to
// its last byte. Read are v1 (2025), v2 (2.0, with or without the scenario's id in front) and v3c (3.0; 123Drive from
// version 0.3 on), little-endian.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"

namespace pictura::pufferdrive {

/// The scene in a file's bytes. Throws Error naming the source and, for each layout that was tried, the first field
/// that does not fit it.
LoggedScene parse_scene(std::string_view bytes, const std::string& source);

}  // namespace pictura::pufferdrive
