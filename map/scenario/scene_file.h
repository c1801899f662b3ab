// Native scene files, *.scenario: the exact states that a simulator drove. Importers read other projects' files, derive
// a map from their contents and round; native files hold the map and every state unchanged.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/map/scenario/scene_cache.h"

namespace pictura {

constexpr std::string_view kSceneFileEnding = ".scenario";

/// File kind for encode_fields() and decode_fields(), used with an empty key.
FieldFileKind scene_file_kind();

/// Writes a file completely or not at all. Throws UsageError for a name without the ending, and Error naming the file.
void write_scene_file(const std::string& path, const Scenario& scenario);

/// Parses and validates a file's bytes; `name` appears in messages. Throws Error "NAME: reason" when the bytes are
/// foreign, truncated or damaged, or written by a version whose scenes have other fields.
Scenario parse_scene_file(std::string_view bytes, const std::string& name);

}  // namespace pictura
