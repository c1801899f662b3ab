#include "pictura/backend_gl/image_faces.h"

#include <algorithm>

#include "pictura/common/raster_gather.h"

namespace pictura::gl {

namespace {

// Strips of one level lie in one plane, where rounding would decide which is in front. Each is therefore pushed away
// from the camera by its place in the order of ranks: by steps well above the rounding of depths (hardware interpolates
// them to 24 bits of the whole range), and in all by less than what parts two levels of road.
constexpr float kPushStep = 1e-4f, kMostPush = 0.02f;

// A strip's plane, lowered, where it is below the camera, by how far solids that stand on it may dip into it: compared
// by depth, they are then in front.
FacePlane lowered(const FacePlane& plane, const PinholeCamera& camera) {
  const Vec3 up{camera.right.z, camera.down.z, camera.forward.z};
  const float above = dot(plane.normal, up);  // also the scale of the offset: above * height of the plane
  const bool camera_above = plane.offset * above <= 0.0f;
  return {plane.normal, camera_above ? plane.offset - kStanding_m * above : plane.offset};
}

ComparedDepth pushed(const FacePlane& plane, float push) {
  if (plane.offset == 0.0f) return {};
  return {plane.normal * (1.0f / plane.offset), push};
}

}  // namespace

void ImageFaces::gather(const ImageSetting& setting, const RasterGeometry& geometry, const SceneBatch& scene,
                        const View& view, int32_t layer) {
  faces_.clear();
  strips_.clear();
  // A convex polygon as a fan of quadrilaterals; with an odd number of corners the last one is a triangle.
  auto add = [&](const Vec3* corners, int count, const ComparedDepth& compared, Rgb color) {
    for (int i = 1; i + 1 < count; i += 2) {
      faces_.push_back(
          {{corners[0], corners[i], corners[i + 1], corners[std::min(i + 2, count - 1)]}, compared, color, layer});
    }
  };
  auto emit = [&](const Vec3* corners, int count, const FacePlane&, Rgb color) { add(corners, count, {}, color); };
  visit_agents(setting, scene, view,
               [&](const AgentBox& box, int32_t) { agent_faces(box, setting.camera, setting.debug_palette, emit); });
  visit_walls(setting, geometry, [&](const WallFace& wall, int32_t) { wall_faces(wall, setting.camera, emit); });
  visit_lights(setting, geometry, scene, view, [&](const LightHead& head, LightState state, int32_t) {
    light_faces(head, state, setting.camera, emit);
  });
  visit_strips(setting, geometry,
               [&](const Strip& strip, int32_t index) { strips_.push_back({strip_number(strip, index), &strip}); });
  std::sort(strips_.begin(), strips_.end(), [](const RankedStrip& a, const RankedStrip& b) { return a.rank < b.rank; });
  const float step = std::min(kPushStep, kMostPush / static_cast<float>(strips_.size() + 1));
  float push = 1.0f;
  for (const RankedStrip& ranked : strips_) {
    push += step;
    auto emit_strip = [&](const Vec3* corners, int count, const FacePlane& plane, Rgb color) {
      add(corners, count, pushed(lowered(plane, setting.camera), push), color);
    };
    strip_faces(*ranked.strip, setting.camera, setting.line_floor_px, emit_strip);
  }
}

}  // namespace pictura::gl
