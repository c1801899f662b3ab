// Pictures of maps from above, and contact sheets of camera images.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/common/image.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// Rectangle on the ground, in the coordinates of the map's file.
struct FileBox {
  double x0_m = 0, y0_m = 0, x1_m = 0, y1_m = 0;
};

struct MapPictureOptions {
  int size_px = 1600;                  // longer side, in [64, 16384]
  std::optional<FileBox> box;          // visible part; default: the whole map
  const Scenario* scenario = nullptr;  // recording whose tracks and boxes are drawn; may be null
};

/// Draws a map from above: surfaces, paint, edges, signs, and lights with phase and visible angle. Adds a legend, the
/// map's properties, coordinates of the map's file, and a scale bar. Throws Error if the size is out of range or the
/// map is empty. Throws Error if the box is not finite, or a side is not between 1 m and 1000 km. Throws Interrupted at
/// ^C.
RgbImage draw_map(const RoadMap& map, const MapPictureOptions& options = {});

/// Writes PNG. Throws Error naming the path.
void draw_map_png(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// Writes SVG; size_px is the nominal size.
void draw_map_svg(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// Returns the pages of a contact sheet, each at most about 8,192 px high. Rows are views and columns are cameras; a
/// wide rig continues in the next row. `images` must be u8 images of the rig. They are enlarged by an integer factor;
/// `enlargement` 0 makes rows about 1600 px wide. Throws Interrupted at ^C.
std::vector<RgbImage> contact_sheets(const HostImages& images, const Rig& rig,
                                     const std::vector<std::string>& view_names, int enlargement = 0);

/// Writes contact_sheet.png, contact_sheet_2.png, ..., and returns the paths. Throws Error naming the path.
std::vector<std::string> draw_contact_sheets(const HostImages& images, const Rig& rig,
                                             const std::vector<std::string>& view_names, FilledFolder* folder);

/// Returns an image above its caption, enlarged by an integer factor to about 480 px width.
RgbImage captioned(const HostImages& images, int view, int camera, const std::string& caption);

/// Copies a picture into a larger one, which must contain it entirely.
void paste(const RgbImage& picture, int left_px, int top_px, RgbImage* image_out);

/// Arranges pictures in rows of three. Throws Error if the list is empty or sizes differ.
RgbImage assembled(const std::vector<RgbImage>& pictures);

}  // namespace pictura
