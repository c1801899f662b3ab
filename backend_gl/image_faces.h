// The faces that one image may show, in camera coordinates. Their shapes, colours and widths follow the rules of all
// renderers (common/raster/). OpenGL projects and clips the faces and decides which are visible.
#pragma once

#include <utility>
#include <vector>

#include "pictura/common/raster/face_setup.h"

namespace pictura::gl {

/// Bounds on the ratio of the depth of a strip's corner to the depth of FaceInstance::compared_plane at the same screen
/// point. The minimum applies beyond the plane's horizon, where the plane counts as infinitely deep. As in the CPU
/// renderer, the plane's depth counts as at least the corner's depth / kWidenedDepth. (The CPU renderer uses the
/// nearest corner of the strip for this bound.)
constexpr float kMinInverseDepth = 1e-4f, kMaxInverseDepth = kWidenedDepth;

/// One instance of the draw call: a flat quadrilateral, in camera coordinates.
struct FaceInstance {
  Vec3 corner[4];  // in order around the quadrilateral
  // The depth test uses the depth of the plane of all points p with dot(compared_plane, p) = 1. If compared_plane is 0,
  // it uses the face's own depth.
  Vec3 compared_plane;
  Rgb color;
  int32_t layer = 0;  // layer of the image array
};

class ImageFaces {
 public:
  /// Replaces the faces by those of one camera of the view. `scene` must be in host memory.
  void build(const ImageSetting& setting, const StaticGeometryView& geometry, const SceneBatch& scene, const View& view,
             int32_t layer);
  Span<const FaceInstance> faces() const { return faces_; }

 private:
  std::vector<FaceInstance> faces_;
  struct RankedStrip {
    uint32_t rank;
    const Strip* strip;
  };
  std::vector<RankedStrip> strips_;
};

}  // namespace pictura::gl
