// What one image draws: the faces of all that its camera may see, by the shared rules of shape, colour and width, in
// camera coordinates. Projection, clipping and visibility are OpenGL's.
#pragma once

#include <utility>
#include <vector>

#include "pictura/common/raster_item.h"

namespace pictura::gl {

/// One instance of the draw call: a flat quadrilateral.
struct FaceInstance {
  struct Corner {
    Vec3 at;                // in camera coordinates
    float nearness = 1.0f;  // its depth over the depth that is compared
  };
  Corner corner[4];  // in order around it
  Rgb color;
  int32_t layer = 0;  // of the image array
};

class ImageFaces {
 public:
  /// Replaces the faces by those that the view shows. `scene` lies on the host.
  void gather(const ImageSetting& setting, const RasterGeometry& geometry, const SceneBatch& scene, const View& view,
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
