// Contact sheets: what the cameras of some agents see, side by side.
#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "pictura/apps/draw_canvas.h"
#include "pictura/apps/drawing.h"
#include "pictura/common/error.h"

namespace pictura {

namespace {

constexpr int kGap_px = 6, kTop_px = 30, kLeft_px = 64;

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

RgbImage contact_sheet(const HostImages& images, const Rig& rig, int num_views, int enlargement) {
  const int num_cameras = static_cast<int>(rig.cameras.size());
  PICTURA_CHECK(num_views >= 1 && num_cameras >= 1, "contact sheet: expected views and cameras, got {} of {}",
                num_views, num_cameras);
  int images_width = 0, row_height = 0;
  for (const Camera& camera : rig.cameras) {
    images_width += camera.width_px;
    row_height = std::max(row_height, camera.height_px);
  }
  constexpr int kWantedWidth_px = 1600;
  if (enlargement <= 0) enlargement = std::max(1, kWantedWidth_px / images_width);
  Canvas canvas(kLeft_px + images_width * enlargement + num_cameras * kGap_px,
                kTop_px + num_views * (row_height * enlargement + kGap_px), hex(0x24272C));
  const Rgb label_color = hex(0xD8DCE2);
  for (int view = 0; view < num_views; ++view) {
    int x = kLeft_px;
    const int y = kTop_px + view * (row_height * enlargement + kGap_px);
    canvas.text(kLeft_px - 10, y + 0.5 * row_height * enlargement + 5, fmt::format("{}", view),
                {.size_px = 15, .align = Align::right, .color = label_color});
    for (int camera = 0; camera < num_cameras; ++camera) {
      const Camera& each = rig.cameras[static_cast<size_t>(camera)];
      paste(canvas, images, view, camera, x, y, enlargement);
      if (view == 0) {
        canvas.text(x + 0.5 * each.width_px * enlargement, kTop_px - 10, each.name,
                    {.size_px = 14, .align = Align::center, .color = label_color});
      }
      x += each.width_px * enlargement + kGap_px;
    }
  }
  return canvas.image();
}

void draw_contact_sheet(const HostImages& images, const Rig& rig, int num_views, const std::string& path) {
  const RgbImage sheet = contact_sheet(images, rig, num_views);
  write_png(path, sheet.width_px, sheet.height_px, sheet.rgb);
}

}  // namespace pictura
