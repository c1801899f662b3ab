// Pictures for people: a map from above, and contact sheets of camera images. See drawing/world.h for a simulated world
// from above and drawing/video.h for videos.
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
  std::optional<FileBox> box;          // what to show; without it, the whole map
  const Scenario* scenario = nullptr;  // whose map it is: its tracks are drawn, and their boxes at its current step
};

/// Draws lanes by type, markings, road edges, crosswalks, parking spaces, building lines, signs, painted stop lines,
/// and lights with their stop lines, phases, and the angle within which their heads are visible; a legend, the map's
/// properties, file coordinates along two sides and a scale bar. Throws Error for a size out of range, a box that is
/// not finite or not between 1 m and 1000 km wide and high, or a map with nothing to draw; Interrupted at ^C.
RgbImage draw_map(const RoadMap& map, const MapPictureOptions& options = {});

/// draw_map() as a PNG file. Throws Error naming the path.
void draw_map_png(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// The same picture as vector graphics; size_px is its nominal size.
void draw_map_svg(const RoadMap& map, const std::string& path, const MapPictureOptions& options = {});

/// Pages of contact sheets, of as many rows as make about 8,192 px: a view a row (more where the rig is too wide for
/// one), a camera a column, every image enlarged by one integer factor without smoothing (0: chosen so that a row is
/// about 1600 px wide), labelled with camera and view names. Images must be u8 images of the rig. Throws Interrupted at
/// ^C.
std::vector<RgbImage> contact_sheets(const HostImages& images, const Rig& rig,
                                     const std::vector<std::string>& view_names, int enlargement = 0);

/// The same as contact_sheet.png, contact_sheet_2.png, ... of a folder, whose paths it returns. Throws Error naming the
/// path.
std::vector<std::string> draw_contact_sheets(const HostImages& images, const Rig& rig,
                                             const std::vector<std::string>& view_names, FilledFolder* folder);

/// One image, enlarged by an integer factor without smoothing to about 480 px, above its caption.
RgbImage captioned(const HostImages& images, int view, int camera, const std::string& caption);

/// Copies a picture into a larger one, which must hold it there.
void paste(const RgbImage& picture, int left_px, int top_px, RgbImage* image_out);

/// Pictures of one size in rows of three. Throws Error if there is none, or sizes differ.
RgbImage assembled(const std::vector<RgbImage>& pictures);

}  // namespace pictura
