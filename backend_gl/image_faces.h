// Faces of one image, in camera coordinates: all that its camera may show, by the shared rules of shape, colour and
// width. OpenGL projects, clips and decides visibility.
#pragma once

#include <utility>
#include <vector>

#include "pictura/common/raster/face_setup.h"

namespace pictura::gl {

/// Bounds on the ratio of a strip corner's depth to that of its compared plane there. The minimum stands for a
/// practically infinite distance, beyond the plane's horizon; the maximum is the oracle's limit for near depths.
constexpr float kMinInverseDepth = 1e-4f, kMaxInverseDepth = kWidenedDepth;

/// One instance of the draw call: a flat quadrilateral, in camera coordinates.
struct FaceInstance {
  Vec3 corner[4];  // in order around it
  // Plane compared_plane . p = 1, whose depth is tested; 0: the face's own depth.
  Vec3 compared_plane;
  Rgb color;
  int32_t layer = 0;  // layer of the image array
};

class ImageFaces {
 public:
  /// Replaces the faces by those of the view. `scene` is in host memory.
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
