// Scenes as files of our own, *.scenario: what a simulator drove, saved to the bit. Importers read other projects'
// files, derive a map from what those have of it and round; these hold the map and every state as they are.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/map/scenario/scene_cache.h"

namespace pictura {

constexpr std::string_view kSceneFileEnding = ".scenario";

/// Of encode_fields() and decode_fields(), with an empty key.
FieldFileKind scene_file_kind();

/// Writes it whole or not at all. Throws UsageError for a name without that ending, Error naming the file.
void write_scene_file(const std::string& path, const Scenario& scenario);

/// The scenario of a file's bytes, validated; `name` is named in messages. Throws Error "NAME: reason" when the bytes
/// are foreign, truncated or damaged, or written by a version whose scenes have other fields.
Scenario parse_scene_file(std::string_view bytes, const std::string& name);

}  // namespace pictura
