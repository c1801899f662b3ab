// What every renderer checks at its door before it draws: the images it is to fill, and scenes that lie on the host.
#pragma once

#include <string_view>

#include "pictura/common/raster_cull.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Throws Error unless the images lie in `space`, fit the rig and the number of views, and have a format that the
/// renderer draws: u8, f32 and, where it says so, f16.
void check_images(std::string_view renderer, const Rig& rig, MemorySpace space, std::size_t num_views,
                  const ImageBatch& images, bool draws_f16 = false);

/// Throws Error unless all spans of a host scene fit together, handles are below num_geometries, lights suffice for the
/// geometries' signals, and every agent's box is finite.
void check_scene(std::string_view renderer, const SceneBatch& scene, Span<const StaticGeometryView> geometries);

/// Throws Error unless each view's world, ego and hidden agents exist in the (host) scene and its pose is finite.
void check_views(std::string_view renderer, const SceneBatch& scene, Span<const View> views);

/// Throws Error unless each query's view and agent exist and there is room for as many answers.
void check_queries(std::string_view renderer, const SceneBatch& scene, std::size_t num_views,
                   Span<const VisibilityQuery> queries, std::size_t num_answers);

/// Throws Error unless each piece is finite, has sizes of 0 or more, and names a signal that exists.
void check_geometry(std::string_view renderer, const StaticGeometry& geometry);

/// The rig's cameras as the rasterizers use them, in the ego frame.
std::vector<PinholeCamera> pinhole_cameras(const Rig& rig);

}  // namespace pictura
