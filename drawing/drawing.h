// Pictures for people: a map from above, and contact sheets of camera images. drawing/world.h draws a simulated world
// from above, and drawing/video.h writes videos.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/common/image.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/map/road_map.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// A rectangle of ground in the coordinates of the map's file.
struct FileBox {
  double x0_m = 0, y0_m = 0, x1_m = 0, y1_m = 0;
};

struct MapPictureOptions {
  int size_px = 1600;                  // the longer side of the picture, in [64, 16384]
  std::optional<FileBox> box;          // visible part; by default the whole map
  const Scenario* scenario = nullptr;  // scenario of the map, whose tracks are drawn, with boxes at its current step
};

/// Draws a map from above: lanes by type, markings, road edges, crosswalks, parking spaces, building lines, signs,
/// painted stop lines, and lights with their stop lines, phases and the angles within which heads are visible. Adds a
/// legend, the map's properties, file coordinates along two sides and a scale bar. Throws Error for a size out of
/// range, a box that is not finite or not between 1 m and 1000 km wide and high, or a map with nothing to draw; throws
/// Interrupted at ^C.
RgbImage draw_map(const RoadMap& map, const MapPictureOptions& options = {});

/// Writes draw_map() as a PNG file. Throws Error naming the path.
void draw_map_png(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// Writes draw_map() as vector graphics; size_px is the nominal size.
void draw_map_svg(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// Returns the pages of a contact sheet, each with rows for about 8,192 px. A row shows one view (several rows if the
/// rig is too wide) and a column one camera, with labels of camera and view names. Images are enlarged by one integer
/// factor without smoothing (0: chosen so that a row is about 1600 px wide), and must be u8 images of the rig. Throws
/// Interrupted at ^C.
std::vector<RgbImage> contact_sheets(const HostImages& images, const Rig& rig,
                                     const std::vector<std::string>& view_names, int enlargement = 0);

/// Writes the pages as contact_sheet.png, contact_sheet_2.png, ... into a folder, and returns the paths. Throws Error
/// naming the path.
std::vector<std::string> draw_contact_sheets(const HostImages& images, const Rig& rig,
                                             const std::vector<std::string>& view_names, FilledFolder* folder);

/// Returns one image, enlarged by an integer factor without smoothing to about 480 px, above its caption.
RgbImage captioned(const HostImages& images, int view, int camera, const std::string& caption);

/// Copies a picture into a larger picture, which must contain it at this place.
void paste(const RgbImage& picture, int left_px, int top_px, RgbImage* image_out);

/// Assembles pictures of one size in rows of three. Throws Error for an empty list or different sizes.
RgbImage assembled(const std::vector<RgbImage>& pictures);

}  // namespace pictura
