// Importer of GPUDrive's JSON scenes, which ScenarioMax also writes.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"

namespace pictura::gpudrive {

/// Throws Error "SOURCE: objects[3].position[17].x: expected ..., got ..." for faults: text other than JSON, missing
/// fields, other types, and non-finite numbers in points or in states flagged valid.
LoggedScene parse_scene(std::string_view text, const std::string& source);

}  // namespace pictura::gpudrive
