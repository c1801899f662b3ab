#include "pictura/drawing/canvas.h"

#include <new>
#include <utility>

#include <cairo-svg.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

cairo_status_t append_svg_bytes(void* text, const unsigned char* data, unsigned int size) {
  try {
    static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(data), size);
  } catch (const std::bad_alloc&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

Canvas::Canvas(cairo_surface_t* surface, std::unique_ptr<std::string>&& svg, const std::string& name, int width_px,
               int height_px, Rgb background)
    : name_(name),
      svg_(std::move(svg)),
      width_px_(width_px),
      height_px_(height_px),
      surface_(surface),
      context_(cairo_create(surface_.get())) {
  check(cairo_surface_status(surface_.get()));
  set_color(background);
  cairo_paint(context());
}

Canvas::Canvas(int width_px, int height_px, Rgb background)
    : Canvas(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px), nullptr,
             fmt::format("picture of {}x{} px", width_px, height_px), width_px, height_px, background) {}

Canvas::Canvas(const std::string& name, int width_px, int height_px, Rgb background)
    : Canvas(std::make_unique<std::string>(), name, width_px, height_px, background) {}

Canvas::Canvas(std::unique_ptr<std::string> svg, const std::string& name, int width_px, int height_px, Rgb background)
    : Canvas(cairo_svg_surface_create_for_stream(append_svg_bytes, svg.get(), width_px, height_px), std::move(svg),
             name, width_px, height_px, background) {}

void Canvas::check(cairo_status_t status) const {
  PICTURA_CHECK(status == CAIRO_STATUS_SUCCESS, "{}: {}", name_, cairo_status_to_string(status));
}

void Canvas::set_color(Rgb color, double alpha) {
  if (work_) work_->check();
  cairo_set_source_rgba(context(), color.r, color.g, color.b, alpha);
}

void Canvas::fill_rectangle(double x, double y, double width, double height, Rgb color, double alpha) {
  set_color(color, alpha);
  cairo_rectangle(context(), x, y, width, height);
  cairo_fill(context());
}

void Canvas::round_rectangle_path(double x, double y, double width, double height, double radius) {
  constexpr double kQuarter = 1.5707963267948966;
  cairo_new_sub_path(context());
  cairo_arc(context(), x + width - radius, y + radius, radius, -kQuarter, 0);
  cairo_arc(context(), x + width - radius, y + height - radius, radius, 0, kQuarter);
  cairo_arc(context(), x + radius, y + height - radius, radius, kQuarter, 2 * kQuarter);
  cairo_arc(context(), x + radius, y + radius, radius, 2 * kQuarter, 3 * kQuarter);
  cairo_close_path(context());
}

void Canvas::select_font(const TextStyle& style) const {
  cairo_select_font_face(context(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context(), style.size_px);
}

double Canvas::text_width(const std::string& words, const TextStyle& style) const {
  select_font(style);
  cairo_text_extents_t extents;
  cairo_text_extents(context(), words.c_str(), &extents);
  return extents.x_advance;
}

double Canvas::text(double x, double y, const std::string& words, const TextStyle& style, double angle_rad) {
  const double width = text_width(words, style);
  cairo_save(context());
  cairo_translate(context(), x, y);
  cairo_rotate(context(), -angle_rad);
  cairo_move_to(context(), style.align == Align::left ? 0 : (style.align == Align::center ? -0.5 * width : -width), 0);
  set_color(style.color);
  cairo_show_text(context(), words.c_str());
  cairo_restore(context());
  return width;
}

RgbImage Canvas::image() const {
  check(cairo_status(context()));
  cairo_surface_flush(surface());
  const unsigned char* data = cairo_image_surface_get_data(surface());
  const auto stride = static_cast<size_t>(cairo_image_surface_get_stride(surface()));
  const auto width = static_cast<size_t>(width_px_), height = static_cast<size_t>(height_px_);
  RgbImage image{width_px_, height_px_, std::vector<uint8_t>(3 * width * height)};
  uint8_t* out = image.rgb.data();
  for (size_t y = 0; y < height; ++y) {
    const auto* row = reinterpret_cast<const uint32_t*>(data + y * stride);
    for (size_t x = 0; x < width; ++x) {
      *out++ = static_cast<uint8_t>(row[x] >> 16);
      *out++ = static_cast<uint8_t>(row[x] >> 8);
      *out++ = static_cast<uint8_t>(row[x]);
    }
  }
  return image;
}

const std::string& Canvas::svg() {
  check(cairo_status(context()));
  cairo_surface_finish(surface());
  check(cairo_surface_status(surface()));
  return *svg_;
}

}  // namespace pictura
