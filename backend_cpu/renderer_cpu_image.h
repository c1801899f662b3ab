// Draws one image: gathers what a camera may see, orders it front to back, and composites it row by row. All rules are
// the shared ones of common/raster*.h; here is only the traversal, and the memory that it reuses from image to image.
#pragma once

#include <functional>
#include <vector>

#include "pictura/common/image.h"
#include "pictura/common/raster_item.h"

namespace pictura {

/// What one image shows.
struct ImageRequest {
  const RasterGeometry* geometry = nullptr;
  const SceneBatch* scene = nullptr;
  const View* view = nullptr;
  PinholeCamera camera;  // in the world
  float line_floor_px = 0;
  bool debug_palette = false;
};

/// Where one image goes.
struct ImageTarget {
  PixelFormat format = PixelFormat::u8;
  void* color = nullptr;  // [3, height, width]
  float* depth_m = nullptr;
  uint8_t* class_id = nullptr;
  uint16_t* instance_id = nullptr;
};

/// An object serves one thread.
class ImageDrawer {
 public:
  /// Collects and orders what the image shows.
  void prepare(const ImageRequest& request);
  /// Draws what was prepared.
  void draw(const ImageTarget& target);
  /// Sum over pixels of what an agent weighs in the prepared image and, in `alone`, of what it would weigh without all
  /// others.
  struct Coverage {
    double seen = 0, alone = 0;
  };
  Coverage coverage_of(int32_t agent);
  /// Calls visit(y * width + x, coverage, colour) for what each face may cover of each pixel of the prepared image,
  /// front to back: for measuring other ways to composite.
  void visit_fragments(const std::function<void(int, const PixelCoverage&, Rgb)>& visit) const;

 private:
  class EdgePool {
   public:
    void clear() { edges_.clear(); }
    int32_t take(int count) {
      edges_.resize(edges_.size() + static_cast<std::size_t>(count));
      return static_cast<int32_t>(edges_.size()) - count;
    }
    PolygonEdge* at(int32_t index) { return edges_.data() + index; }
    const PolygonEdge* at(int32_t index) const { return edges_.data() + index; }

   private:
    std::vector<PolygonEdge> edges_;
  };

  // That an item of the foreground is drawn before another.
  struct Hiding {
    int32_t behind, weight;  // which other, and order_on_screen's weight
    int32_t next;            // the next of what the item hides, or -1
  };

  struct PlacedBox {
    PixelBox box;
    int32_t place;  // in foreground_
  };

  // Adds a thing whose faces make_faces(emit) emits, unless none of them is in the image.
  template <typename MakeFaces>
  void add_item(const RasterItem& item, MakeFaces&& make_faces);
  void gather();
  void find_background();
  void sort_items();
  void find_hidings();
  void sort_foreground();
  template <typename Visit>
  void visit_pixels(const RasterItem& item, int y_begin, int y_end, Visit&& visit) const;
  void draw_planes(const ImageTarget& target) const;

  ImageRequest request_;
  ImageSetting setting_;
  EdgePool edges_;
  std::vector<ScreenFace> faces_;
  std::vector<RasterItem> items_;
  std::vector<int32_t> order_;       // items front to back
  std::vector<int32_t> foreground_;  // items that need a pairwise order, nearest first
  std::vector<PlacedBox> sweep_;     // [foreground]
  std::vector<Hiding> hidings_;
  std::vector<int32_t> first_hiding_;  // [foreground] the first in hidings_ of what an item hides, or -1
  std::vector<int64_t> waiting_for_;   // [foreground] weight of what hides an item and is still to be drawn
  std::vector<int32_t> ready_;         // of the foreground: what nothing hides that is still to be drawn
  std::vector<PixelState> pixels_;
};

}  // namespace pictura
