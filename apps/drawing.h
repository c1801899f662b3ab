// Pictures for people: a map from above, and what the cameras of some agents see, side by side. See draw_world.h for a
// simulated world from above, draw_plot.h for curves and video.h for film.
#pragma once

#include <string>

#include "pictura/common/image.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Draws lanes by type, markings, road edges, lights with their stop lines, crosswalks, parking spaces, a legend, the
/// map's facts and a scale bar. The longer side is size_px, in [64, 16384]; throws Error otherwise.
RgbImage draw_map(const RoadMap& map, int size_px = 1600);

/// draw_map() as a PNG file (beside, then renamed). Throws Error naming the path.
void draw_map_png(const RoadMap& map, const std::string& path, int size_px = 1600);

/// Rows of views, columns of cameras, every image enlarged by one whole factor without smoothing (0: chosen so that the
/// sheet is about 1600 px wide), labelled with camera names and view numbers. Images must hold u8 colour of the rig.
RgbImage contact_sheet(const HostImages& images, const Rig& rig, int num_views, int enlargement = 0);

/// contact_sheet() as a PNG file. Throws Error naming the path.
void draw_contact_sheet(const HostImages& images, const Rig& rig, int num_views, const std::string& path);

}  // namespace pictura
