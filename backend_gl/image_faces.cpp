#include "pictura/backend_gl/image_faces.h"

#include <algorithm>

#include "pictura/common/raster_gather.h"

namespace pictura::gl {

namespace {

// Strips of one level lie in one plane, where rounding would decide which is in front. Each is therefore pushed away
// from the camera by its place in the order of ranks: by steps well above the rounding of depths, and in all by less
// than what parts two levels of road.
constexpr float kPushStep = 2e-5f, kMostPush = 0.02f;
// What the compared depth of a corner beyond the horizon of a strip's plane is a multiple of: as good as infinite.
constexpr float kLeastNearness = 1e-4f;

// normal . p = offset, in camera coordinates.
struct Plane {
  Vec3 normal;
  float offset = 0;
};

// The plane whose depths decide about a strip: its own, and not that of its corners as drawn, which the floor on its
// width moves; lowered, seen from above, by how far solids that stand on it may dip into it.
Plane depth_plane(const Strip& strip, const PinholeCamera& camera) {
  const Extent extent = strip_extent(strip, 0, camera.position_m);
  const Vec3 normal = strip_normal(extent);
  const Interval heights = project_on(extent, normal);
  const float height_m = 0.5f * (heights.low + heights.high);
  const bool camera_above = height_m <= 0.0f;
  return {{dot(camera.right, normal), dot(camera.down, normal), dot(camera.forward, normal)},
          camera_above ? height_m - kStanding_m : height_m};
}

float nearness(const Plane& plane, Vec3 p) {
  return plane.offset == 0.0f ? 1.0f : std::max(dot(plane.normal, p) / plane.offset, kLeastNearness);
}

}  // namespace

void ImageFaces::gather(const ImageSetting& setting, const RasterGeometry& geometry, const SceneBatch& scene,
                        const View& view, int32_t layer) {
  faces_.clear();
  strips_.clear();
  // A convex polygon as a fan of quadrilaterals; with an odd number of corners the last one is a triangle.
  auto emit = [&](const Vec3* corners, int count, Rgb color) {
    for (int i = 1; i + 1 < count; i += 2) {
      faces_.push_back(
          {{{corners[0]}, {corners[i]}, {corners[i + 1]}, {corners[std::min(i + 2, count - 1)]}}, color, layer});
    }
  };
  visit_agents(setting, scene, view,
               [&](const AgentBox& box, int32_t) { agent_faces(box, setting.camera, setting.debug_palette, emit); });
  visit_walls(setting, geometry, [&](const WallFace& wall, int32_t) { wall_faces(wall, setting.camera, emit); });
  visit_lights(setting, geometry, scene, view, [&](const LightHead& head, LightState state, int32_t) {
    light_faces(head, state, setting.camera, emit);
  });
  visit_strips(setting, geometry, [&](const Strip& strip, int32_t index) {
    strips_.push_back({rank_of(strip, static_cast<uint32_t>(index)), &strip});
  });
  std::sort(strips_.begin(), strips_.end(), [](const RankedStrip& a, const RankedStrip& b) { return a.rank < b.rank; });
  const float step = std::min(kPushStep, kMostPush / static_cast<float>(strips_.size() + 1));
  float push = 1.0f;
  for (const RankedStrip& ranked : strips_) {
    push += step;
    const std::size_t first = faces_.size();
    strip_faces(*ranked.strip, setting.camera, setting.line_floor_px, emit);
    const Plane plane = depth_plane(*ranked.strip, setting.camera);
    for (std::size_t i = first; i < faces_.size(); ++i) {
      for (FaceInstance::Corner& corner : faces_[i].corner) corner.nearness = nearness(plane, corner.at) / push;
    }
  }
}

}  // namespace pictura::gl
