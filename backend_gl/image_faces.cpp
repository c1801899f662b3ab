#include "pictura/backend_gl/image_faces.h"

#include <algorithm>

#include "pictura/common/raster/visible_primitives.h"

namespace pictura::gl {

namespace {

// Maximum depth offsets of strips. Strips of one level are nearly coplanar, and the strip with the lower rank must be
// in front. So the depth test uses offset depths, which grow with a strip's rank. If the camera is above a strip, the
// offset is away from the camera, and its rank-dependent part is at most kMaxPush_m. This is several times the distance
// between strips of one level, but small compared with the distance between two levels of road. If the camera is below
// a strip, objects on the strip must be behind the strip, even objects in its plane. So the strip is moved towards the
// camera, by one to two times kMaxPushShare of the distance of its plane.
constexpr float kMaxPush_m = 4 * kSameLevel_m, kMaxPushShare = 0.01f;

// Returns the plane whose depth is tested instead of a strip's depth. `order` is the strip's rank among the strips of
// the image, scaled to [0, 1]. If the plane is below the camera, it is also lowered by kStanding_m, so that solids that
// extend through the strip are in front.
Vec3 compared_plane(const FacePlane& plane, const PinholeCamera& camera, float order) {
  const Vec3 up{camera.right.z, camera.down.z, camera.forward.z};
  const float above = dot(plane.normal, up);  // raising the plane by h adds h * above to its offset
  const bool camera_above = plane.offset * above <= 0.0f;
  const float offset = camera_above ? plane.offset - (kStanding_m + order * kMaxPush_m) * above
                                    : plane.offset * (1.0f - (2.0f - order) * kMaxPushShare);
  return offset == 0.0f ? Vec3{} : plane.normal * (1.0f / offset);
}

}  // namespace

void ImageFaces::build(const ImageSetting& setting, const StaticGeometryView& geometry, const SceneBatch& scene,
                       const View& view, int32_t layer) {
  faces_.clear();
  strips_.clear();
  // Adds a convex polygon as a fan of quadrilaterals. If the number of corners is odd, the last quadrilateral is a
  // triangle.
  auto add = [&](const Vec3* corners, int count, Vec3 compared, Rgb color) {
    for (int i = 1; i + 1 < count; i += 2) {
      faces_.push_back(
          {{corners[0], corners[i], corners[i + 1], corners[std::min(i + 2, count - 1)]}, compared, color, layer});
    }
  };
  auto emit = [&](const CameraFace& face) { add(face.corners, face.count, {}, face.color); };
  visit_agents(setting, scene, view,
               [&](const AgentBox& box, int32_t) { agent_faces(box, setting.camera, setting.debug_palette, emit); });
  visit_walls(setting, geometry, [&](const WallFace& wall, int32_t) { wall_faces(wall, setting.camera, emit); });
  visit_lights(setting, geometry, scene, view, [&](const LightHead& head, LightState state, int32_t) {
    light_faces(head, state, setting.camera, emit);
  });
  visit_strips(setting, geometry,
               [&](const Strip& strip, int32_t index) { strips_.push_back({strip_object_id(strip, index), &strip}); });
  std::sort(strips_.begin(), strips_.end(), [](const RankedStrip& a, const RankedStrip& b) { return a.rank < b.rank; });
  for (std::size_t i = 0; i < strips_.size(); ++i) {
    const float order = static_cast<float>(i) / static_cast<float>(strips_.size());
    auto emit_strip = [&](const CameraFace& face) {
      Vec3 corners[kMaxWidenedCorners];
      const int count =
          widen_in_front(setting.camera, face.floor_px, face.corners, [&](int k, Vec3 p) { corners[k] = p; });
      add(corners, count, compared_plane(face.plane, setting.camera, order), face.color);
    };
    strip_faces(*strips_[i].strip, setting.camera, setting.line_floor_px, emit_strip);
  }
}

}  // namespace pictura::gl
