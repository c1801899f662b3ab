// Importer of GPUDrive's JSON scenes. PufferDrive's converters read the same format, and ScenarioMax writes it.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"

namespace pictura::gpudrive {

/// Parses the text of a scene file. Throws Error "SOURCE: objects[3].position[17].x: expected ..., got ..." if the text
/// is not JSON, or if a field is missing or has another type. Also throws Error if a valid state or a point contains a
/// number that is not finite.
LoggedScene parse_scene(std::string_view text, const std::string& source);

}  // namespace pictura::gpudrive
