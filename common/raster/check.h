// Checks that each renderer makes before drawing, on the images to fill and on scenes in host memory.
#pragma once

#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/common/raster/cull.h"
#include "pictura/common/raster/host_geometries.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Throws Error unless both devices are equal. In the message, `what` is "scene" or "images".
void check_device(std::string_view renderer, std::string_view what, Device expected, Device device);

/// Throws Error unless the images lie on the renderer's device, fit its rig and the number of views, and have an order
/// and a format that the renderer draws.
void check_images(const Renderer& renderer, std::size_t num_views, const ImageBatch& images);

/// Returns the configuration. Throws Error unless the rig is valid, the line floor is at most kMaxLineFloor_px, and the
/// randomization is within kMaxCameraRandomization.
const RendererConfig& check_config(std::string_view renderer, const RendererConfig& config);

/// Throws Error unless all spans of a host scene have consistent lengths and all handles refer to uploaded geometries.
/// Each world must have enough lights (has_enough_lights()) and at most kMaxBoxesPerWorld agents. Hidden agents must
/// exist, and every agent's box must be finite.
void check_scene(std::string_view renderer, const SceneBatch& scene, const HostGeometries& geometries);

/// Throws Error unless each view's world, ego and range of hidden agents exist in the host scene, which check_scene()
/// must have accepted. A view's pose must be finite, and the agent of its key must be below RandomKey::kMaxAgents.
void check_views(std::string_view renderer, const SceneBatch& scene, Span<const View> views);

/// Returns the first `count` views of a host batch. Throws Error unless the count is between 0 and the number of views.
Span<const View> counted_views(std::string_view renderer, const ViewBatch& views);

/// Throws Error unless the number of answers equals the number of visibility queries.
void check_answers(std::string_view renderer, std::size_t num_queries, std::size_t num_answers);

/// Throws Error unless each query's view is below max_views and there are as many answers as queries. If the query's
/// view is one of `views`, which check_views() accepted, the query's agent must be in the world of that view.
void check_queries(std::string_view renderer, const SceneBatch& scene, Span<const View> views, std::size_t max_views,
                   Span<const VisibilityQuery> queries, std::size_t num_answers);

/// Throws Error unless the handle is valid for uploads.
void check_handle(std::string_view renderer, GeometryHandle handle);

/// Throws Error unless both sizes of Renderer::reserve are non-negative.
void check_reserved(std::string_view renderer, int max_views, int max_boxes);

/// Throws Error unless all strips, walls and light heads are finite, strips and walls have non-negative sizes and
/// colours in [0, 1], and light heads have existing signals. The grids must contain all strips and walls.
void check_geometry(std::string_view renderer, const StaticGeometry& geometry);

/// Converts a rig's cameras to the form that rasterizers use, in the ego frame.
std::vector<PinholeCamera> pinhole_cameras(const Rig& rig);

}  // namespace pictura
