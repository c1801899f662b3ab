// Checks that renderers make before drawing.
#pragma once

#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/common/raster/cull.h"
#include "pictura/common/raster/host_geometries.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Throws Error unless both devices are equal. `what` is "scene" or "images".
void check_device(std::string_view renderer, std::string_view what, Device expected, Device device);

/// Throws Error unless the renderer can draw num_views views into these images.
void check_images(const Renderer& renderer, std::size_t num_views, const ImageBatch& images);

/// Returns the configuration. Throws Error if its rig, line floor or randomization is invalid.
const RendererConfig& check_config(std::string_view renderer, const RendererConfig& config);

/// Throws Error if a host scene is inconsistent or a handle has no uploaded geometry.
void check_scene(std::string_view renderer, const SceneBatch& scene, const HostGeometries& geometries);

/// Throws Error unless each view is valid for the host scene, which check_scene() must have accepted.
void check_views(std::string_view renderer, const SceneBatch& scene, Span<const View> views);

/// Returns the first `count` views of a host batch. Throws Error if the count is out of range.
Span<const View> counted_views(std::string_view renderer, const ViewBatch& views);

/// Throws Error unless both numbers are equal.
void check_answers(std::string_view renderer, std::size_t num_queries, std::size_t num_answers);

/// Throws Error unless each query's view is below max_views and there are as many answers as queries. If `views`
/// contains the view, its world must contain the query's agent.
void check_queries(std::string_view renderer, const SceneBatch& scene, Span<const View> views, std::size_t max_views,
                   Span<const VisibilityQuery> queries, std::size_t num_answers);

/// Throws Error unless the handle is valid for uploads.
void check_handle(std::string_view renderer, GeometryHandle handle);

/// Throws Error if an argument of Renderer::reserve() is negative.
void check_reserved(std::string_view renderer, int max_views, int max_boxes);

/// Throws Error if a value is not finite, a size is negative, a colour is outside [0, 1], a signal is missing, or a
/// grid lacks an item.
void check_geometry(std::string_view renderer, const StaticGeometry& geometry);

/// Converts a rig's cameras, in the ego frame.
std::vector<PinholeCamera> pinhole_cameras(const Rig& rig);

}  // namespace pictura
