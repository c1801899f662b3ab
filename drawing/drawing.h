// Pictures of maps from above, and contact sheets of camera images. drawing/world.h draws a simulated world from above,
// and drawing/video.h writes videos.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/common/image.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// A rectangle on the ground, in the coordinates of the map's file.
struct FileBox {
  double x0_m = 0, y0_m = 0, x1_m = 0, y1_m = 0;
};

struct MapPictureOptions {
  int size_px = 1600;                  // the longer side of the picture, in [64, 16384]
  std::optional<FileBox> box;          // visible part; by default the whole map
  const Scenario* scenario = nullptr;  // optional scenario on the map: its tracks, and its boxes at the current step
};

/// Draws a map from above: lanes by type, markings, road edges, crosswalks, parking spaces, building lines, signs,
/// painted stop lines, and lights. A light is drawn with its stop line, its phase, and the angle within which its head
/// is visible. Adds a legend, the map's properties, coordinates of the map's file along two sides, and a scale bar.
/// Throws Error if the size is out of range, if the box is not finite or a side is not between 1 m and 1000 km, or if
/// the map has nothing to draw. Throws Interrupted at ^C.
RgbImage draw_map(const RoadMap& map, const MapPictureOptions& options = {});

/// Writes draw_map() as a PNG file. Throws Error naming the path.
void draw_map_png(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// Writes draw_map() as an SVG file; size_px is the nominal size.
void draw_map_svg(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// Returns the pages of a contact sheet, each up to about 8,192 px high. A row shows one view and a column shows one
/// camera, labelled with their names. A rig that is too wide continues in the next row. `images` must be u8 images of
/// the rig. They are enlarged by an integer factor without smoothing; if `enlargement` is 0, a row becomes about 1600
/// px wide. Throws Interrupted at ^C.
std::vector<RgbImage> contact_sheets(const HostImages& images, const Rig& rig,
                                     const std::vector<std::string>& view_names, int enlargement = 0);

/// Writes the pages to contact_sheet.png, contact_sheet_2.png, ... in a folder, and returns the paths. Throws Error
/// naming the path.
std::vector<std::string> draw_contact_sheets(const HostImages& images, const Rig& rig,
                                             const std::vector<std::string>& view_names, FilledFolder* folder);

/// Returns a picture of one image above its caption. The image is enlarged without smoothing, by the integer factor
/// that makes it about 480 px wide.
RgbImage captioned(const HostImages& images, int view, int camera, const std::string& caption);

/// Copies a picture into a larger picture. The copy must be entirely inside the larger picture.
void paste(const RgbImage& picture, int left_px, int top_px, RgbImage* image_out);

/// Assembles pictures of equal size in rows of three. Throws Error if the list is empty or the sizes differ.
RgbImage assembled(const std::vector<RgbImage>& pictures);

}  // namespace pictura
