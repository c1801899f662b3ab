// Native scene files, *.scenario, with the exact states of a simulation.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/map/scenario/scene_cache.h"

namespace pictura {

constexpr std::string_view kSceneFileEnding = ".scenario";

/// Kind of native scene files. Their SceneCacheKey is SceneCacheKey{}.
FieldFileKind scene_file_kind();

/// Writes the file completely or not at all. Throws UsageError for a name without kSceneFileEnding. Throws Error, which
/// names the file, on failure.
void write_scene_file(const std::string& path, const Scenario& scenario);

/// Parses and validates. Throws Error "NAME: reason" for foreign, truncated or damaged bytes, and for files of a
/// pictura version whose scenes have other fields.
Scenario parse_scene_file(std::string_view bytes, const std::string& name);

}  // namespace pictura
