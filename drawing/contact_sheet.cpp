// Contact sheets: the camera images of some agents in a grid.
#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/drawing/canvas.h"
#include "pictura/drawing/drawing.h"

namespace pictura {

namespace {

constexpr int kGap_px = 6, kTop_px = 30, kLeft_px = 64;
constexpr int kPanelWidth_px = 480, kPanelColumns = 3;
constexpr Rgb kSheetColor = hex(0x24272C), kLabelColor = hex(0xD8DCE2);

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

}  // namespace

RgbImage contact_sheet(const HostImages& images, const Rig& rig, const std::vector<std::string>& view_names,
                       int enlargement) {
  const int num_cameras = static_cast<int>(rig.cameras.size()), num_views = static_cast<int>(view_names.size());
  PICTURA_CHECK(num_views >= 1 && num_cameras >= 1, "contact sheet: expected views and cameras, got {} of {}",
                num_views, num_cameras);
  int images_width = 0, row_height = 0;
  for (const Camera& camera : rig.cameras) {
    images_width += camera.width_px;
    row_height = std::max(row_height, camera.height_px);
  }
  constexpr int kWantedWidth_px = 1600;
  if (enlargement <= 0) enlargement = std::max(1, kWantedWidth_px / images_width);
  const TextStyle view_style{.size_px = 15, .align = Align::right, .color = kLabelColor};
  int left_px = kLeft_px;
  {
    const Canvas ruler(1, 1, kSheetColor);
    for (const std::string& name : view_names) {
      left_px = std::max(left_px, 20 + static_cast<int>(ruler.text_width(name, view_style)));
    }
  }
  Canvas canvas(left_px + images_width * enlargement + num_cameras * kGap_px,
                kTop_px + num_views * (row_height * enlargement + kGap_px), kSheetColor);
  for (int view = 0; view < num_views; ++view) {
    int x = left_px;
    const int y = kTop_px + view * (row_height * enlargement + kGap_px);
    canvas.text(left_px - 10, y + 0.5 * row_height * enlargement + 5, view_names[static_cast<size_t>(view)],
                view_style);
    for (int camera = 0; camera < num_cameras; ++camera) {
      const Camera& each = rig.cameras[static_cast<size_t>(camera)];
      paste(canvas, images, view, camera, x, y, enlargement);
      if (view == 0) {
        canvas.text(x + 0.5 * each.width_px * enlargement, kTop_px - 10, each.name,
                    {.size_px = 14, .align = Align::center, .color = kLabelColor});
      }
      x += each.width_px * enlargement + kGap_px;
    }
  }
  return canvas.image();
}

void draw_contact_sheet(const HostImages& images, const Rig& rig, const std::vector<std::string>& view_names,
                        const std::string& path) {
  const RgbImage sheet = contact_sheet(images, rig, view_names);
  write_png(path, sheet.width_px, sheet.height_px, sheet.rgb);
}

RgbImage captioned(const HostImages& images, int view, int camera, const std::string& caption) {
  const CameraImages& size = images.camera(camera);
  const int enlargement = std::max(1, kPanelWidth_px / size.width_px);
  const int width_px = size.width_px * enlargement, height_px = size.height_px * enlargement;
  Canvas canvas(width_px, height_px + kTop_px, kSheetColor);
  paste(canvas, images, view, camera, 0, 0, enlargement);
  canvas.text(0.5 * width_px, height_px + 20, caption, {.size_px = 15, .align = Align::center, .color = kLabelColor});
  return canvas.image();
}

RgbImage assembled(const std::vector<RgbImage>& pictures) {
  PICTURA_CHECK(!pictures.empty(), "figure: expected one or more pictures");
  const int width_px = pictures[0].width_px, height_px = pictures[0].height_px;
  const int columns = std::min(kPanelColumns, static_cast<int>(pictures.size()));
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  Canvas canvas(columns * (width_px + kGap_px) - kGap_px, rows * (height_px + kGap_px) - kGap_px, hex(0xFFFFFF));
  RgbImage all = canvas.image();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const RgbImage& picture = pictures[i];
    PICTURA_CHECK(picture.width_px == width_px && picture.height_px == height_px,
                  "figure: expected pictures of {}x{} pixels, got {}x{}", width_px, height_px, picture.width_px,
                  picture.height_px);
    const int left_px = static_cast<int>(i) % columns * (width_px + kGap_px);
    const int top_px = static_cast<int>(i) / columns * (height_px + kGap_px);
    for (int y = 0; y < height_px; ++y) {
      std::copy_n(picture.rgb.begin() + std::ptrdiff_t{3} * y * width_px, 3 * width_px,
                  all.rgb.begin() + std::ptrdiff_t{3} * ((top_px + y) * all.width_px + left_px));
    }
  }
  return all;
}

}  // namespace pictura
