// A thing of the scene as an image sees it: its faces on screen, what it occupies, and its place in the order. Shared
// by both devices, which differ only in how they share out the work and where they keep the results.
#pragma once

#include "pictura/common/raster_coverage.h"
#include "pictura/common/raster_cull.h"
#include "pictura/common/raster_order.h"

namespace pictura {

/// What one image shows, and how.
struct ImageSetting {
  PinholeCamera camera;  // in the world
  Frustum frustum;
  float line_floor_px = 0;
  bool debug_palette = false;
};

struct RasterItem {
  int32_t face_begin = 0, face_end = 0;
  PixelBox box;
  int32_t agent = -1;          // index into SceneBatch::agents
  uint8_t class_id = 0;        // of the class plane
  bool is_background = false;  // a strip that lies behind all solids
  OrderKey key;
  Extent extent;  // unset for the background, which is ordered by key alone
};

/// Most faces that a thing shows at once: three of a cuboid.
constexpr int kMaxItemFaces = 3;

// Numbers of things are unique within an image: kind, then index.
constexpr uint32_t kAgentNumber = 0u << 28, kWallNumber = 1u << 28, kLightNumber = 2u << 28, kStripNumber = 3u << 28;

/// Faces of one thing, while they are made.
struct ItemFaces {
  ScreenFace face[kMaxItemFaces];
  int32_t count = 0;
  PixelBox box;
};

/// Clips and projects one face of a thing and appends it. Edges go to a pool: take(count) returns the index of the
/// first, or -1 where there is no room left, and at(index) its address.
template <typename EdgePool>
PICTURA_HD inline void add_face(const ImageSetting& setting, const Vec3* corners, int count, Rgb color, EdgePool& pool,
                                ItemFaces* faces) {
  Vec3 polygon[kMaxPolygonCorners];
  const int kept = clip_face(setting.frustum, corners, count, polygon);
  if (kept < 3 || faces->count == kMaxItemFaces) return;
  const int32_t edge_begin = pool.take(kept);
  if (edge_begin < 0) return;
  ScreenFace& face = faces->face[faces->count];
  if (!make_screen_face(setting.camera, polygon, kept, color, pool.at(edge_begin), &face)) return;
  face.edge_begin = edge_begin;
  faces->box = faces->count == 0 ? face.box : united(faces->box, face.box);
  ++faces->count;
}

PICTURA_HD inline RasterItem agent_item(const ImageSetting& setting, const AgentBox& box, int32_t agent,
                                        int32_t world_begin) {
  RasterItem item;
  item.agent = agent;
  item.class_id = static_cast<uint8_t>(static_cast<int>(SurfaceClass::vehicle) + static_cast<int>(box.agent_class));
  item.extent = agent_extent(box, setting.camera.position_m);
  item.key = {nearest_distance2(item.extent), kAgentNumber | static_cast<uint32_t>(agent - world_begin)};
  return item;
}

PICTURA_HD inline RasterItem wall_item(const ImageSetting& setting, const WallFace& wall, int32_t index) {
  RasterItem item;
  item.class_id = static_cast<uint8_t>(SurfaceClass::wall);
  item.extent = wall_extent(wall, setting.camera.position_m);
  item.key = {nearest_distance2(item.extent), kWallNumber | static_cast<uint32_t>(index)};
  return item;
}

PICTURA_HD inline RasterItem light_item(const ImageSetting& setting, const LightHead& head, int32_t index) {
  RasterItem item;
  item.class_id = static_cast<uint8_t>(SurfaceClass::light);
  item.extent = light_extent(head, setting.camera.position_m);
  item.key = {nearest_distance2(item.extent), kLightNumber | static_cast<uint32_t>(index)};
  return item;
}

/// Height of a solid's lowest point above the camera.
PICTURA_HD inline float foot_of(const RasterItem& solid) {
  float foot_m = solid.extent.low_m[0];
  for (int i = 1; i < solid.extent.corners; ++i) foot_m = min_of(foot_m, solid.extent.low_m[i]);
  return foot_m;
}
/// ... of an image without solids.
constexpr float kNoFoot_m = 1e30f;

/// lowest_foot_m: the least foot_of all solids that the image shows.
PICTURA_HD inline RasterItem strip_item(const ImageSetting& setting, const Strip& strip, int32_t index,
                                        float lowest_foot_m) {
  RasterItem item;
  item.class_id = static_cast<uint8_t>(kClassOfStrip + static_cast<int>(strip.kind));
  const float high_m = max_of(strip.a_m.z, strip.b_m.z) - setting.camera.position_m.z;
  item.is_background = lies_behind_all(high_m, lowest_foot_m);
  if (item.is_background) {
    item.key = {0.0f, rank_of(strip, static_cast<uint32_t>(index))};
  } else {
    item.extent = strip_extent(strip, static_cast<uint32_t>(index), setting.camera.position_m);
    item.key = {nearest_distance2(item.extent), kStripNumber | static_cast<uint32_t>(index)};
  }
  return item;
}

/// Order of two things of the foreground whose keys ascend, as order_of says; 0 where they do not meet on screen.
PICTURA_HD inline int order_on_screen(const RasterItem& nearer, const RasterItem& farther) {
  return overlap(nearer.box, farther.box) ? order_of(nearer.extent, farther.extent) : 0;
}

/// What the instance plane says of a thing.
PICTURA_HD inline uint16_t instance_of(const RasterItem& item, int32_t world_begin) {
  return static_cast<uint16_t>(item.agent < 0 ? 0 : 1 + item.agent - world_begin);
}

}  // namespace pictura
