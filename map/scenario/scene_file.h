// Native scene files, *.scenario, with the exact states that a simulator computed. They contain the map and every state
// unchanged. Importers of other formats, in contrast, derive a map and round states.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/map/scenario/scene_cache.h"

namespace pictura {

constexpr std::string_view kSceneFileEnding = ".scenario";

/// Returns the file kind for encode_fields() and decode_fields(). Native files use it with a default SceneCacheKey.
FieldFileKind scene_file_kind();

/// Writes a file, completely or not at all. Throws UsageError for a name without the ending kSceneFileEnding, and
/// Error, which names the file, if it cannot be written.
void write_scene_file(const std::string& path, const Scenario& scenario);

/// Parses and validates the bytes of a file. `name` appears in messages. Throws Error "NAME: reason" if the bytes are
/// of another file type, are truncated or damaged, or were written by a version whose scenes have other fields.
Scenario parse_scene_file(std::string_view bytes, const std::string& name);

}  // namespace pictura
