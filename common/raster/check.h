// Checks that every renderer makes before it draws: of the images that it is to fill, and of scenes on the host.
#pragma once

#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/common/raster/cull.h"
#include "pictura/common/raster/host_geometries.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Throws Error unless `what`, "scene" or "images", lies on the device that the renderer draws from and to.
void check_device(std::string_view renderer, std::string_view what, Device expected, Device device);

/// Throws Error unless the images lie where the renderer draws to, fit its rig and the number of views, and have an
/// order and a format that it draws.
void check_images(const Renderer& renderer, std::size_t num_views, const ImageBatch& images);

/// Throws Error unless the rig is valid, the line floor within the guard band and the randomization within
/// kMaxCameraRandomization; returns the configuration.
const RendererConfig& check_config(std::string_view renderer, const RendererConfig& config);

/// Throws Error unless all spans of a host scene fit together, handles hold geometries, lights suffice for their
/// signals, worlds are not too large, hidden agents exist, and every agent's box is finite.
void check_scene(std::string_view renderer, const SceneBatch& scene, const HostGeometries& geometries);

/// Throws Error unless each view's world, ego and range of hidden agents exist in the (host) scene that check_scene
/// passed, its pose is finite, and its key's agent is one of random numbers.
void check_views(std::string_view renderer, const SceneBatch& scene, Span<const View> views);

/// The views of a batch on the host that its count includes. Throws Error unless that is 0 to the number of views.
Span<const View> counted_views(std::string_view renderer, const ViewBatch& views);

/// Throws Error unless there are as many answers as visibility queries.
void check_answers(std::string_view renderer, std::size_t num_queries, std::size_t num_answers);

/// Throws Error unless each query's view is one of max_views, its agent, where the view is one of `views`, which
/// check_views passed, is of that view's world, and there are as many answers as queries.
void check_queries(std::string_view renderer, const SceneBatch& scene, Span<const View> views, std::size_t max_views,
                   Span<const VisibilityQuery> queries, std::size_t num_answers);

/// Throws Error unless the handle is one that geometries can be uploaded to.
void check_handle(std::string_view renderer, GeometryHandle handle);

/// Throws Error unless both sizes of Renderer::reserve are 0 or more.
void check_reserved(std::string_view renderer, int max_views, int max_boxes);

/// Throws Error unless each piece is finite, has sizes of 0 or more, colours of 0 to 1, and names a signal that exists,
/// and the grids hold all pieces.
void check_geometry(std::string_view renderer, const StaticGeometry& geometry);

/// The rig's cameras as the rasterizers use them, in the ego frame.
std::vector<PinholeCamera> pinhole_cameras(const Rig& rig);

}  // namespace pictura
