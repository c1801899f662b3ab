// The faces that one image may show, by the rules of common/raster/.
#pragma once

#include <utility>
#include <vector>

#include "pictura/common/raster/face_setup.h"

namespace pictura::gl {

/// Bounds on the ratio of the depth of a strip's corner to that of FaceInstance::compared_plane at the same screen
/// point. Beyond the plane's horizon, the minimum applies. The maximum is that of the CPU renderer.
constexpr float kMinInverseDepth = 1e-4f, kMaxInverseDepth = kWidenedDepth;

/// A flat quadrilateral in camera coordinates: one instance of the draw call.
struct FaceInstance {
  Vec3 corner[4];  // in order around the quadrilateral
  // The depth test uses the plane of all points p with dot(compared_plane, p) = 1; if compared_plane is 0, the face's
  // own plane.
  Vec3 compared_plane;
  Rgb color;
  int32_t layer = 0;  // layer of the image array
};

class ImageFaces {
 public:
  /// Collects the faces of one camera of the view. `scene` must be in host memory.
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
