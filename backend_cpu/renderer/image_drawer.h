// Drawing of one image: sets up the faces of visible primitives, rasterizes them into fragments (a fragment is the part
// of a pixel that one face covers), and composites each pixel. The rules of drawing are in common/raster.
#pragma once

#include <functional>
#include <vector>

#include "pictura/backend_cpu/renderer/fast/cull_x8.h"
#include "pictura/common/image.h"
#include "pictura/common/raster/face_setup.h"
#include "pictura/common/raster/randomize_camera.h"

namespace pictura {

struct ImageRequest {
  const CulledGeometry* geometry = nullptr;
  const SceneBatch* scene = nullptr;
  const View* view = nullptr;
  PinholeCamera camera;  // in the world
  float line_floor_px = 0;
  bool debug_palette = false;
  bool culls_occluded = true;    // drop faces behind the largest boxes and walls
  const Crowd* crowd = nullptr;  // sorted boxes of the view's world; null: every box is tested
};

struct ImageTarget {
  PixelFormat format = PixelFormat::u8;
  void* color = nullptr;
  float* depth_m = nullptr;
  uint8_t* class_id = nullptr;
  uint16_t* instance_id = nullptr;
  ChannelOrder order = ChannelOrder::planar;  // or patches
  int patch_px = kDefaultPatch_px;
  ImageEffect effect;
};

/// Draws one image at a time, in one thread.
class ImageDrawer {
 public:
  /// Sets up the faces of an image.
  void prepare(const ImageRequest& request);
  const Occluders& occluders() const { return setting_.occluders; }
  void draw(const ImageTarget& target);
  /// Adds the agent's visible weight in the prepared image to sum_inout->among_all, and its weight without other
  /// primitives to sum_inout->alone.
  void accumulate_visibility(int32_t agent, VisibilitySum* sum_inout);
  /// Calls visit(y * width + x, coverage, colour) for each pixel's fragments, front to back.
  void visit_fragments(const std::function<void(int, const PixelCoverage&, Rgb)>& visit);

 private:
  class EdgePool {
   public:
    void clear() { edges_.clear(); }
    int32_t take(int count) {
      edges_.resize(edges_.size() + static_cast<std::size_t>(count));
      return static_cast<int32_t>(edges_.size()) - count;
    }
    void put(int32_t index, const PolygonEdge& edge) { edges_[index] = edge; }
    const PolygonEdge* at(int32_t index) const { return edges_.data() + index; }

   private:
    std::vector<PolygonEdge> edges_;
  };

  // An element of a pixel's list of fragments.
  struct PixelFragment {
    PixelCoverage coverage;
    int32_t face;
    int32_t next;
  };

  // An agent's face, or a wall.
  struct Solid {
    PrimitiveRef primitive;
    uint32_t entry = 0;
    bool may_occlude = false;
    CameraQuad in_camera;
  };

  struct OccludingFace {
    const Solid* solid = nullptr;
    float covered_px2 = 0;
    ScreenQuad quad;
    bool is_clockwise = false;
  };

  // Half-open ranges.
  struct FaceRange {
    int32_t begin, end;
  };
  struct RowRange {
    int y_begin, y_end;
  };

  void find_solids();
  void make_lights();
  void make_strips();
  template <typename Visit>
  void visit_boxes(Visit&& visit);
  void find_occluders();
  // Returns a function that sets up the faces of a primitive.
  auto face_maker(PrimitiveRef primitive);
  template <typename Visit>
  void visit_spans(const ScreenFace& face, RowRange rows, Visit&& visit) const;
  void find_occluder_bounds(FaceRange faces, RowRange rows);
  void make_fragments(FaceRange faces, RowRange rows);
  void collect_fragments(int32_t first);
  void order_pixel(int x, int y);
  void resolve_occlusion(RowRange rows);
  // Calls visit(pixel index, fragment, weight) for each fragment of a pixel, then finish(pixel index, colour).
  template <typename Visit, typename Finish>
  void composite_rows(RowRange rows, Visit&& visit, Finish&& finish);
  void draw_planes(const ImageTarget& target) const;
  bool stands(uint32_t solid, uint32_t strip) const;
  int32_t world_begin() const { return request_.scene->world_begin[request_.view->world]; }

  ImageRequest request_;
  ImageSetting setting_;
  std::vector<Solid> solids_;
  std::vector<OccludingFace> occluding_;
  EdgePool edges_;
  std::vector<ScreenFace> faces_;
  std::vector<int32_t> found_;  // boxes or light heads that may be visible
  std::vector<int32_t> strips_;
  std::vector<float> occluder_bounds_;   // [pixels of the rows] maximum occluder_bound()
  std::vector<int32_t> first_fragment_;  // [pixels of the rows]
  std::vector<PixelFragment> fragments_;
  std::vector<PixelFragment> collected_;
  std::vector<uint64_t> visible_;                  // visible samples, parallel to collected_
  std::vector<std::size_t> pixel_ends_;            // for each pixel, the end of its fragments in collected_
  std::vector<PixelAccumulator::Weight> weights_;  // weights of one pixel's fragments
};

}  // namespace pictura
