// What one image draws: the faces of all that its camera may see, by the shared rules of shape, colour and width, in
// camera coordinates. Projection, clipping and visibility are OpenGL's.
#pragma once

#include <utility>
#include <vector>

#include "pictura/common/raster/face_setup.h"

namespace pictura::gl {

/// Bounds on the depth of a strip's corner over that of its compared plane there: as good as infinitely far, beyond the
/// horizon of the plane, and as near as the oracle lets it come.
constexpr float kMinNearness = 1e-4f, kMaxNearness = kWidenedDepth;

/// One instance of the draw call: a flat quadrilateral, in camera coordinates.
struct FaceInstance {
  Vec3 corner[4];  // in order around it
  // The plane compared_plane . p = 1, whose depth decides what is in front; 0: the face's own depth does.
  Vec3 compared_plane;
  Rgb color;
  int32_t layer = 0;  // of the image array
};

class ImageFaces {
 public:
  /// Replaces the faces by those that the view shows. `scene` lies on the host.
  void gather(const ImageSetting& setting, const StaticGeometryView& geometry, const SceneBatch& scene,
              const View& view, int32_t layer);
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
