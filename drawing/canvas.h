// Canvas on a Cairo surface. Private to the drawing library.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <cairo.h>

#include "pictura/common/color.h"
#include "pictura/common/image.h"
#include "pictura/common/support/interrupt.h"

namespace pictura {

constexpr Rgb hex(uint32_t rrggbb) {
  return rgb8(static_cast<int>(rrggbb >> 16) & 255, static_cast<int>(rrggbb >> 8) & 255,
              static_cast<int>(rrggbb) & 255);
}

enum class Align { left, center, right };

struct TextStyle {
  double size_px = 12;
  bool bold = false;
  Align align = Align::left;
  Rgb color = hex(0x22262B);
};

/// Opaque image or SVG document. Coordinates are pixels unless Cairo's matrix is changed.
class Canvas {
 public:
  /// Creates an image. Throws Error when the surface cannot be created.
  Canvas(int width_px, int height_px, Rgb background);
  /// Creates an SVG document; `name` is its name in messages.
  Canvas(const std::string& name, int width_px, int height_px, Rgb background);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  cairo_t* context() const { return context_.get(); }
  cairo_surface_t* surface() const { return surface_.get(); }

  /// After this call, set_color() throws Interrupted with this message at ^C. Every shape calls set_color().
  void stop_when_interrupted(const std::string& message) { work_.emplace(message); }

  void set_color(Rgb color, double alpha = 1);
  void fill_rectangle(double x, double y, double width, double height, Rgb color, double alpha = 1);
  /// Appends a rounded rectangle to the path.
  void round_rectangle_path(double x, double y, double width, double height, double radius);
  /// Draws text with its baseline at y, rotated counter-clockwise. Returns the text's width in pixels.
  double text(double x, double y, const std::string& words, const TextStyle& style, double angle_rad = 0);
  double text_width(const std::string& words, const TextStyle& style) const;

  /// Throws Error with Cairo's reason if any earlier call failed.
  RgbImage image() const;
  /// Ends and returns the SVG document. Throws Error as image() does.
  const std::string& svg();

 private:
  struct Free {
    void operator()(cairo_t* context) const { cairo_destroy(context); }
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  };
  Canvas(std::unique_ptr<std::string> svg, const std::string& name, int width_px, int height_px, Rgb background);
  // `svg` is a reference, because the caller computes `surface` from the same pointer, and evaluation order is
  // unspecified.
  Canvas(cairo_surface_t* surface, std::unique_ptr<std::string>&& svg, const std::string& name, int width_px,
         int height_px, Rgb background);
  void check(cairo_status_t status) const;
  void select_font(const TextStyle& style) const;

  std::string name_;                  // in messages
  std::unique_ptr<std::string> svg_;  // Cairo writes to this address
  std::optional<InterruptibleWork> work_;
  int width_px_, height_px_;
  std::unique_ptr<cairo_surface_t, Free> surface_;
  std::unique_ptr<cairo_t, Free> context_;
};

}  // namespace pictura
