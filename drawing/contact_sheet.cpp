// Contact sheets: camera images in a grid of views and cameras.
#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/drawing/canvas.h"
#include "pictura/drawing/drawing.h"

namespace pictura {

namespace {

constexpr int kImageGap_px = 6, kCameraNames_px = 30, kViewNames_px = 64;
constexpr int kPanelWidth_px = 480, kPanelColumns = 3;
constexpr int kWantedWidth_px = 1600;
// Limits of a page, which a first camera or a first row may exceed. Cairo draws at most 32,767 px per side.
constexpr int kMaxPageWidth_px = 16384, kMaxPageHeight_px = 8192;
constexpr Rgb kSheetColor = hex(0x24272C), kSheetLabelColor = hex(0xD8DCE2);
const TextStyle kViewStyle{.size_px = 15, .align = Align::right, .color = kSheetLabelColor};

void paste(Canvas& canvas, const HostImages& images, int view, int camera, int x0, int y0, int enlargement) {
  const std::vector<uint8_t> rgb = images.interleaved(view, camera);
  const CameraImages& size = images.camera(camera);
  cairo_surface_flush(canvas.surface());
  unsigned char* data = cairo_image_surface_get_data(canvas.surface());
  const int stride = cairo_image_surface_get_stride(canvas.surface());
  for (int y = 0; y < size.height_px * enlargement; ++y) {
    auto* row = reinterpret_cast<uint32_t*>(data + static_cast<std::ptrdiff_t>(y0 + y) * stride) + x0;
    const uint8_t* source = rgb.data() + std::size_t{3} * static_cast<std::size_t>((y / enlargement) * size.width_px);
    for (int x = 0; x < size.width_px * enlargement; ++x) {
      const uint8_t* pixel = source + 3 * (x / enlargement);
      row[x] = uint32_t{pixel[0]} << 16 | uint32_t{pixel[1]} << 8 | pixel[2];
    }
  }
  cairo_surface_mark_dirty(canvas.surface());
}

// Images of cameras [first_camera, end_camera) of one view, side by side.
struct SheetRow {
  int view, first_camera, end_camera;
};

// Rows and sizes of all pages. A rig that is too wide for one row continues in the next row.
struct SheetLayout {
  int enlargement = 1, left_px = kViewNames_px, row_px = 0, width_px = 0;
  std::vector<SheetRow> rows;

  /// Whether camera names are drawn above a row: on the first row of a page, and on a row whose cameras differ from
  /// those of the row above.
  bool has_names(const SheetRow* row, const SheetRow* first) const {
    return row == first || row->first_camera != row[-1].first_camera;
  }
  /// Returns the rows of each page, at least one.
  std::vector<Span<const SheetRow>> pages() const {
    std::vector<Span<const SheetRow>> result;
    for (const SheetRow *first = rows.data(), *const last = first + rows.size(); first != last;) {
      const SheetRow* row = first;
      for (int height_px = 0; row != last; ++row) {
        height_px += row_px + (has_names(row, first) ? kCameraNames_px : 0);
        if (row != first && height_px > kMaxPageHeight_px) break;
      }
      result.emplace_back(first, static_cast<std::size_t>(row - first));
      first = row;
    }
    return result;
  }
};

SheetLayout layout_of(const Rig& rig, const std::vector<std::string>& view_names, int enlargement) {
  PICTURA_CHECK(!view_names.empty() && !rig.cameras.empty(), "contact sheet: expected views and cameras, got {} of {}",
                view_names.size(), rig.cameras.size());
  SheetLayout layout;
  int images_width_px = 0, image_height_px = 0;
  for (const Camera& camera : rig.cameras) {
    images_width_px += camera.width_px;
    image_height_px = std::max(image_height_px, camera.height_px);
  }
  layout.enlargement =
      enlargement > 0 ? enlargement
                      : std::max(1, std::min(kWantedWidth_px / images_width_px, kMaxPageHeight_px / image_height_px));
  layout.row_px = image_height_px * layout.enlargement + kImageGap_px;
  const Canvas ruler(1, 1, kSheetColor);
  for (const std::string& name : view_names) {
    layout.left_px = std::max(layout.left_px, 20 + static_cast<int>(ruler.text_width(name, kViewStyle)));
  }
  layout.left_px = std::min(layout.left_px, kMaxPageWidth_px);
  const int num_cameras = static_cast<int>(rig.cameras.size());
  for (int view = 0; view < static_cast<int>(view_names.size()); ++view) {
    for (int first = 0; first < num_cameras;) {
      int end = first, row_width_px = 0;
      for (; end < num_cameras; ++end) {
        const int width_px = rig.cameras[end].width_px * layout.enlargement + kImageGap_px;
        if (end > first && row_width_px + width_px > kMaxPageWidth_px) break;
        row_width_px += width_px;
      }
      layout.rows.push_back({view, first, end});
      layout.width_px = std::max(layout.width_px, layout.left_px + row_width_px);
      first = end;
    }
  }
  return layout;
}

RgbImage page_of(const HostImages& images, const Rig& rig, const std::vector<std::string>& view_names,
                 const SheetLayout& layout, Span<const SheetRow> rows) {
  int height_px = 0;
  for (const SheetRow& row : rows)
    height_px += layout.row_px + (layout.has_names(&row, rows.data()) ? kCameraNames_px : 0);
  Canvas canvas(layout.width_px, height_px, kSheetColor);
  canvas.stop_when_interrupted("contact sheet: interrupted while it was drawn");
  int y = 0;
  for (const SheetRow& row : rows) {
    const bool has_names = layout.has_names(&row, rows.data());
    if (has_names) y += kCameraNames_px;
    canvas.text(layout.left_px - 10, y + 0.5 * (layout.row_px - kImageGap_px) + 5, view_names[row.view], kViewStyle);
    int x = layout.left_px;
    for (int camera = row.first_camera; camera < row.end_camera; ++camera) {
      const Camera& each = rig.cameras[camera];
      const int width_px = each.width_px * layout.enlargement;
      paste(canvas, images, row.view, camera, x, y, layout.enlargement);
      if (has_names) {
        canvas.text(x + 0.5 * width_px, y - 10, each.name,
                    {.size_px = 14, .align = Align::center, .color = kSheetLabelColor});
      }
      x += width_px + kImageGap_px;
    }
    y += layout.row_px;
  }
  return canvas.image();
}

}  // namespace

std::vector<RgbImage> contact_sheets(const HostImages& images, const Rig& rig,
                                     const std::vector<std::string>& view_names, int enlargement) {
  const SheetLayout layout = layout_of(rig, view_names, enlargement);
  std::vector<RgbImage> pages;
  for (const Span<const SheetRow> rows : layout.pages())
    pages.push_back(page_of(images, rig, view_names, layout, rows));
  return pages;
}

std::vector<std::string> draw_contact_sheets(const HostImages& images, const Rig& rig,
                                             const std::vector<std::string>& view_names, FilledFolder* folder) {
  const SheetLayout layout = layout_of(rig, view_names, 0);
  std::vector<std::string> paths;
  for (const Span<const SheetRow> rows : layout.pages()) {
    const std::string page_number = paths.empty() ? "" : fmt::format("_{}", paths.size() + 1);
    paths.push_back(folder->file(fmt::format("contact_sheet{}.png", page_number)));
    const RgbImage page = page_of(images, rig, view_names, layout, rows);
    write_png(paths.back(), page.width_px, page.height_px, page.rgb);
  }
  return paths;
}

RgbImage captioned(const HostImages& images, int view, int camera, const std::string& caption) {
  const CameraImages& size = images.camera(camera);
  const int enlargement = std::max(1, kPanelWidth_px / size.width_px);
  const int width_px = size.width_px * enlargement, height_px = size.height_px * enlargement;
  Canvas canvas(width_px, height_px + kCameraNames_px, kSheetColor);
  paste(canvas, images, view, camera, 0, 0, enlargement);
  canvas.text(0.5 * width_px, height_px + 20, caption,
              {.size_px = 15, .align = Align::center, .color = kSheetLabelColor});
  return canvas.image();
}

void paste(const RgbImage& picture, int left_px, int top_px, RgbImage* image_out) {
  for (int y = 0; y < picture.height_px; ++y) {
    std::copy_n(
        picture.rgb.begin() + std::ptrdiff_t{3} * y * picture.width_px, 3 * picture.width_px,
        image_out->rgb.begin() + std::ptrdiff_t{3} * (std::ptrdiff_t{top_px + y} * image_out->width_px + left_px));
  }
}

RgbImage assembled(const std::vector<RgbImage>& pictures) {
  PICTURA_CHECK(!pictures.empty(), "figure: expected one or more pictures");
  const int width_px = pictures[0].width_px, height_px = pictures[0].height_px;
  const int columns = std::min(kPanelColumns, static_cast<int>(pictures.size()));
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  RgbImage all{
      columns * (width_px + kImageGap_px) - kImageGap_px, rows * (height_px + kImageGap_px) - kImageGap_px, {}};
  constexpr uint8_t kWhite = 255;
  all.rgb.assign(std::size_t{3} * static_cast<std::size_t>(all.width_px) * static_cast<std::size_t>(all.height_px),
                 kWhite);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const RgbImage& picture = pictures[i];
    PICTURA_CHECK(picture.width_px == width_px && picture.height_px == height_px,
                  "figure: expected pictures of {}x{} pixels, got {}x{}", width_px, height_px, picture.width_px,
                  picture.height_px);
    const int left_px = static_cast<int>(i) % columns * (width_px + kImageGap_px);
    const int top_px = static_cast<int>(i) / columns * (height_px + kImageGap_px);
    paste(picture, left_px, top_px, &all);
  }
  return all;
}

}  // namespace pictura
